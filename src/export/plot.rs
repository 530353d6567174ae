//! Curves over time as an SVG: straight axes, one colour a curve, a legend.

use plotters::prelude::*;

use crate::readable::short;

/// Width and height in pixels.
const EXTENT: (u32, u32) = (900, 540);

/// Part of the range of the values that is left free above and below the curves.
const MARGIN: f64 = 0.04;

/// Part of an axis that is rounding of its marks.
const ROUNDING: f64 = 1e-9;

/// One curve.
pub struct Curve {
    /// Name in the legend.
    pub name: String,
    /// Time and value; points that are not finite are left out.
    pub points: Vec<(f64, f64)>,
}

/// The title and the axes.
pub struct Labels<'a> {
    /// Above the plot.
    pub title: &'a str,
    /// Below it, with the unit.
    pub time: &'a str,
    /// At its left, with the unit.
    pub value: &'a str,
}

/// The plot as the text of an SVG file.
pub fn svg(labels: &Labels, curves: &[Curve]) -> String {
    let mut text = String::new();
    {
        let root = SVGBackend::with_string(&mut text, EXTENT).into_drawing_area();
        draw(&root, labels, curves).and_then(|()| root.present()).expect("a text takes any drawing");
    }
    text
}

type Area<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;
type Drawn<'a> = Result<(), DrawingAreaErrorKind<<SVGBackend<'a> as DrawingBackend>::ErrorType>>;

fn draw<'a>(root: &Area<'a>, labels: &Labels, curves: &[Curve]) -> Drawn<'a> {
    root.fill(&WHITE)?;
    let finite = |curve: &Curve| -> Vec<(f64, f64)> {
        curve.points.iter().copied().filter(|(time, value)| time.is_finite() && value.is_finite()).collect()
    };
    let shown: Vec<_> = curves.iter().map(finite).collect();
    let times = range(shown.iter().flatten().map(|point| point.0), 0.0);
    let values = range(shown.iter().flatten().map(|point| point.1), MARGIN);
    let [x_step, y_step] = [&times, &values].map(|range| ROUNDING * (range.end - range.start));
    let mut chart = ChartBuilder::on(root)
        .caption(labels.title, ("sans-serif", 20))
        .margin(12)
        .x_label_area_size(40)
        .y_label_area_size(70)
        .build_cartesian_2d(times, values)?;
    chart
        .configure_mesh()
        .x_desc(labels.time)
        .y_desc(labels.value)
        .x_label_formatter(&mark(x_step))
        .y_label_formatter(&mark(y_step))
        .draw()?;
    for (index, (curve, points)) in curves.iter().zip(shown).enumerate() {
        let colour = Palette99::pick(index).to_rgba();
        chart
            .draw_series(LineSeries::new(points, colour.stroke_width(2)))?
            .label(&curve.name)
            .legend(move |(x, y)| PathElement::new(vec![(x, y), (x + 18, y)], colour.stroke_width(2)));
    }
    chart.configure_series_labels().background_style(WHITE.mix(0.8)).border_style(BLACK).draw()
}

/// The text of a mark on an axis; what is rounding of its extent is zero.
fn mark(rounding: f64) -> impl Fn(&f64) -> String {
    move |value| short(if value.abs() < rounding { 0.0 } else { *value })
}

/// A range that holds all values, wider by a part of itself; never empty.
fn range(values: impl Iterator<Item = f64>, margin: f64) -> std::ops::Range<f64> {
    let ends = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
    match ends {
        (low, high) if low > high => 0.0..1.0,
        (low, high) if low == high => low - 0.5 * low.abs().max(1.0)..high + 0.5 * high.abs().max(1.0),
        (low, high) => low - margin * (high - low)..high + margin * (high - low),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plot_shows_its_names_and_survives_what_cannot_be_shown() {
        let labels = Labels { title: "strain", time: "time, s", value: "percent" };
        let curve = |name: &str, points: &[(f64, f64)]| Curve { name: name.into(), points: points.to_vec() };
        let curves = [
            curve("alpha = 10 s", &[(0.0, 0.0), (1.0, 2.5), (2.0, f64::NAN), (3.0, 1.0)]),
            curve("a < b & c", &[(0.0, 1e300), (f64::INFINITY, 1.0)]),
        ];
        let text = svg(&labels, &curves);
        assert!(text.starts_with("<svg") && text.trim_end().ends_with("</svg>"));
        for word in ["alpha = 10 s", "a &lt; b &amp; c", "time, s", "percent"] {
            assert!(text.contains(word), "{word}");
        }
        for points in [vec![], vec![(0.0, 3.0), (1.0, 3.0)], vec![(5.0, -1e-9), (5.0, 2e-9)]] {
            assert!(svg(&labels, &[Curve { name: "one".into(), points }]).contains("</svg>"));
        }
    }
    /// A micron over a microsecond: 1e-6 was written as 0.
    #[test]
    fn marks_have_digits_at_any_scale() {
        assert_eq!([0.1 + 0.2, 2.0, -1e-17, 1e-6].map(|x| mark(1e-9)(&x)), ["0.3", "2", "0", "1e-6"]);
        let labels = Labels { title: "strain", time: "time, s", value: "m" };
        let text = svg(&labels, &[Curve { name: "one".into(), points: vec![(0.0, 0.0), (1e-6, 2e-6)] }]);
        let marks = || text.lines().map(str::trim).filter(|line| line.parse::<f64>().is_ok());
        assert!(marks().filter(|mark| *mark == "0").count() <= 2 && marks().any(|mark| mark.contains("e-")), "{text}");
    }
}
