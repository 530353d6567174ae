//! Error against time as an SVG, both axes logarithmic: down is more accurate, left is faster.

use plotters::coord::combinators::IntoLogRange;
use plotters::prelude::*;

/// Width and height in pixels.
const EXTENT: (u32, u32) = (900, 600);

/// One curve.
pub struct Series {
    /// Name in the legend.
    pub name: String,
    /// Seconds, error, and a word beside the point (may be empty); points that are not positive cannot be shown.
    pub points: Vec<(f64, f64, String)>,
}

/// The title and the axes.
pub struct Labels<'a> {
    /// Above the chart.
    pub title: &'a str,
    /// Below it, with the unit.
    pub time: &'a str,
    /// At its left, with the unit.
    pub error: &'a str,
}

/// The chart as the text of an SVG file, the points of a series joined by lines.
pub fn svg(labels: &Labels, series: &[Series]) -> String {
    drawn(labels, series, 2)
}

/// The chart with points that are not joined.
pub fn points(labels: &Labels, series: &[Series]) -> String {
    drawn(labels, series, 0)
}

fn drawn(labels: &Labels, series: &[Series], width: u32) -> String {
    let mut text = String::new();
    {
        let root = SVGBackend::with_string(&mut text, EXTENT).into_drawing_area();
        draw(&root, labels, series, width).and_then(|()| root.present()).expect("a text takes any drawing");
    }
    text
}

type Area<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;
type Drawn<'a> = Result<(), DrawingAreaErrorKind<<SVGBackend<'a> as DrawingBackend>::ErrorType>>;

fn draw<'a>(root: &Area<'a>, labels: &Labels, series: &[Series], width: u32) -> Drawn<'a> {
    root.fill(&WHITE)?;
    let visible = |point: &&(f64, f64, String)| point.0 > 0.0 && point.1 > 0.0 && (point.0 * point.1).is_finite();
    let all: Vec<_> = series.iter().flat_map(|s| s.points.iter().filter(visible)).collect();
    let (times, errors) = (range(all.iter().map(|p| p.0)), range(all.iter().map(|p| p.1)));
    let mut chart = ChartBuilder::on(root)
        .caption(labels.title, ("sans-serif", 20))
        .margin(12)
        .x_label_area_size(40)
        .y_label_area_size(70)
        .build_cartesian_2d(times.log_scale(), errors.log_scale())?;
    chart
        .configure_mesh()
        .x_desc(labels.time)
        .y_desc(labels.error)
        .x_label_formatter(&|x| format!("{x:.0e}"))
        .y_label_formatter(&|y| format!("{y:.0e}"))
        .draw()?;
    for (index, one) in series.iter().enumerate() {
        let colour = Palette99::pick(index).to_rgba();
        let points: Vec<_> = one.points.iter().filter(visible).collect();
        let curve = points.iter().map(|point| (point.0, point.1));
        chart
            .draw_series(LineSeries::new(curve.clone().filter(|_| width > 0), colour.stroke_width(width)))?
            .label(&one.name)
            .legend(move |(x, y)| PathElement::new(vec![(x, y), (x + 18, y)], colour.stroke_width(2)));
        chart.draw_series(curve.map(|at| Circle::new(at, if width > 0 { 2 } else { 4 }, colour.filled())))?;
        chart.draw_series(points.iter().filter(|point| !point.2.is_empty()).map(|point| {
            EmptyElement::at((point.0, point.1)) + Text::new(point.2.clone(), (6, -14), ("sans-serif", 13))
        }))?;
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperRight)
        .background_style(WHITE.mix(0.8))
        .border_style(BLACK)
        .draw()
}

/// A range that holds all values, widened so that no curve lies on the frame.
fn range(values: impl Iterator<Item = f64>) -> std::ops::Range<f64> {
    let (low, high) = values.fold((f64::INFINITY, 0.0_f64), |(low, high), value| (low.min(value), high.max(value)));
    if low > high { 0.1..10.0 } else { 0.6 * low..1.8 * high }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chart_shows_its_names_and_survives_points_that_have_no_logarithm() {
        let labels = Labels { title: "error against time", time: "s", error: "residual" };
        let points = vec![(1e-3, 1e-15, "9^3".into()), (0.1, 0.0, String::new()), (f64::NAN, 1.0, String::new())];
        let text = svg(&labels, &[Series { name: "direct".into(), points }]);
        assert!(text.starts_with("<svg") && text.trim_end().ends_with("</svg>"));
        for word in ["direct", "error against time", "9^3"] {
            assert!(text.contains(word), "{word}");
        }
        assert!(svg(&labels, &[]).contains("</svg>"));
    }
}
