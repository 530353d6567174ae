//! Knot vectors: where the pieces of a spline meet.
//!
//! A spline of degree p with n basis functions has n + p + 1 knots t_0 <= t_1 <= ... <= t_{n+p}. It is *open*: the first
//! and the last value stand p + 1 times, so the end control points are the ends of the curve. Inside, a knot that stands
//! m times leaves p - m continuous derivatives; m <= p, so that the curve never tears. A *span* is the index i of a
//! non-empty interval [t_i, t_{i+1}]; the spans are the elements of isogeometric analysis (2.26-2.27). The functions
//! that act on span i are those with the numbers i - p ..= i.
//!
//! Example (thesis 2.5.1): p = 2, knots 0 0 0 .2 .4 .4 .8 1 1 1 make n = 7 functions on the spans 2, 3, 5, 6.

use crate::error::{Error, Result};

/// Largest polynomial degree; the work arrays of the basis have this size.
pub const MAX_DEGREE: usize = 9;

/// An open knot vector with its degree.
#[derive(Debug, Clone, PartialEq)]
pub struct KnotVector {
    degree: usize,
    knots: Vec<f64>,
}

impl KnotVector {
    /// Checks and keeps `knots` (n + `degree` + 1 values of any range such as [0, 4]).
    ///
    /// # Errors
    /// [`Error::Input`] with the key `geometry.degree`, `geometry.knots` or `geometry.knots[i]`: a degree outside
    /// 1..=[`MAX_DEGREE`], too few knots, a knot that is not finite or lies below the one before, ends that do not
    /// stand exactly p + 1 times, an inner knot that stands more than p times.
    pub fn new(degree: usize, knots: Vec<f64>) -> Result<Self> {
        check_degree(degree)?;
        let (order, count) = (degree + 1, knots.len());
        if count < 2 * order {
            return Err(Error::input(
                "geometry.knots",
                format!("{count} knots are too few for degree {degree}"),
                format!("give at least {}: each end stands degree + 1 = {order} times", 2 * order),
            ));
        }
        if let Some(i) = knots.iter().position(|knot| !knot.is_finite()) {
            return Err(bad_knot(i, format!("knot {i} is {}", knots[i]), "knots are finite numbers"));
        }
        if let Some(i) = (1..count).find(|&i| knots[i] < knots[i - 1]) {
            let message = format!("knot {i} is {}, below the one before, {}", knots[i], knots[i - 1]);
            return Err(bad_knot(i, message, "knots never decrease"));
        }
        check_multiplicities(degree, &knots)?;
        Ok(Self { degree, knots })
    }

    /// Open knots on [0, 1] with `n_basis` - `degree` equal spans.
    ///
    /// # Errors
    /// [`Error::Input`]: `geometry.degree` outside 1..=[`MAX_DEGREE`], or `geometry.control_points` with
    /// `n_basis` <= `degree`.
    pub fn open_uniform(degree: usize, n_basis: usize) -> Result<Self> {
        check_degree(degree)?;
        if n_basis <= degree {
            return Err(Error::input(
                "geometry.control_points",
                format!("{n_basis} control points are too few for degree {degree}"),
                format!("give at least degree + 1 = {}", degree + 1),
            ));
        }
        let spans = n_basis - degree;
        let inner = (1..spans).map(|i| i as f64 / spans as f64);
        let knots = std::iter::repeat_n(0.0, degree + 1).chain(inner).chain(std::iter::repeat_n(1.0, degree + 1));
        Self::new(degree, knots.collect())
    }

    /// Polynomial degree p.
    pub fn degree(&self) -> usize {
        self.degree
    }

    /// The knots, n + p + 1 of them.
    pub fn knots(&self) -> &[f64] {
        &self.knots
    }

    /// Number of basis functions n.
    #[expect(clippy::len_without_is_empty, reason = "there is always at least one span")]
    pub fn len(&self) -> usize {
        self.knots.len() - self.degree - 1
    }

    /// First and last knot: the range of the parameter.
    pub fn range(&self) -> (f64, f64) {
        (self.knots[0], self.knots[self.knots.len() - 1])
    }

    /// The non-empty span that holds `xi`: t_i <= xi < t_{i+1}. The last span holds its right end too, and a value
    /// outside the range belongs to the nearest span.
    pub fn find_span(&self, xi: f64) -> usize {
        let inner = &self.knots[self.degree + 1..self.len()];
        self.degree + inner.partition_point(|&knot| knot <= xi)
    }

    /// The indices i of the non-empty spans [t_i, t_{i+1}], ascending.
    pub fn spans(&self) -> Vec<usize> {
        (self.degree..self.len()).filter(|&i| self.knots[i] < self.knots[i + 1]).collect()
    }

    /// Greville abscissa of function `i`: the mean of t_{i+1} ..= t_{i+p}, where its control point acts most.
    pub fn greville(&self, i: usize) -> f64 {
        let inner = &self.knots[i + 1..=i + self.degree];
        let mean = inner.iter().sum::<f64>() / self.degree as f64;
        // The rounding of the mean must not carry it over a knot.
        mean.clamp(inner[0], inner[self.degree - 1])
    }
}

/// Refuses degrees that the basis cannot do.
fn check_degree(degree: usize) -> Result<()> {
    if (1..=MAX_DEGREE).contains(&degree) {
        return Ok(());
    }
    let help = format!("degrees go from 1 to {MAX_DEGREE}");
    Err(Error::input("geometry.degree", format!("degree {degree} is not possible"), help))
}

/// Refuses ends that are not open and inner knots that tear the curve; `knots` are finite and ascending.
fn check_multiplicities(degree: usize, knots: &[f64]) -> Result<()> {
    let mut start = 0;
    while start < knots.len() {
        let times = knots[start..].partition_point(|&knot| knot <= knots[start]);
        let end = start + times;
        let value = knots[start];
        let inner = start > 0 && end < knots.len();
        if inner && times > degree {
            let message = format!("knot {value} stands {times} times inside");
            return Err(bad_knot(start, message, &format!("at most the degree, {degree} times")));
        }
        if !inner && times != degree + 1 {
            let message = format!("the end knot {value} stands {times} times");
            return Err(bad_knot(start, message, &format!("knots are open: degree + 1 = {} times", degree + 1)));
        }
        start = end;
    }
    Ok(())
}

fn bad_knot(index: usize, message: String, help: &str) -> Error {
    Error::input(format!("geometry.knots[{index}]"), message, help)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn thesis() -> KnotVector {
        KnotVector::new(2, vec![0.0, 0.0, 0.0, 0.2, 0.4, 0.4, 0.8, 1.0, 1.0, 1.0]).unwrap()
    }

    #[test]
    fn spans_are_found_with_their_ends() {
        let knots = thesis();
        assert_eq!(knots.len(), 7);
        assert_eq!(knots.spans(), [2, 3, 5, 6]);
        let found: Vec<usize> = [-1.0, 0.0, 0.2, 0.39, 0.4, 0.9, 1.0, 2.0].map(|xi| knots.find_span(xi)).into();
        assert_eq!(found, [2, 2, 3, 3, 5, 6, 6, 6]);
        assert_eq!(knots.greville(3), 0.4);
    }

    #[test]
    fn uniform_knots_are_equal_steps() {
        let knots = KnotVector::open_uniform(2, 6).unwrap();
        assert_eq!(knots.knots(), [0.0, 0.0, 0.0, 0.25, 0.5, 0.75, 1.0, 1.0, 1.0]);
        assert!(KnotVector::new(1, vec![0.0, 0.0, 2.0, 4.0, 4.0]).is_ok());
    }

    #[test]
    fn bad_knots_are_refused_with_their_index() {
        let nan = f64::NAN;
        let cases: [(usize, &[f64], &str); 9] = [
            (0, &[0.0, 1.0], "geometry.degree"),
            (10, &[0.0, 1.0], "geometry.degree"),
            (2, &[0.0, 0.0, 0.0, 1.0, 1.0], "geometry.knots"),
            (2, &[0.0; 6], "geometry.knots[0]"),
            (1, &[0.0, 0.0, nan, 1.0, 1.0], "geometry.knots[2]"),
            (1, &[0.0, 0.0, 0.6, 0.5, 1.0, 1.0], "geometry.knots[3]"),
            (1, &[0.0, 0.0, 0.5, 0.5, 1.0, 1.0], "geometry.knots[2]"),
            (2, &[0.0, 0.0, 0.1, 1.0, 1.0, 1.0], "geometry.knots[0]"),
            (2, &[0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0], "geometry.knots[3]"),
        ];
        for (degree, knots, place) in cases {
            match KnotVector::new(degree, knots.to_vec()) {
                Err(Error::Input { key, help, .. }) => {
                    assert_eq!(key, place, "{knots:?}");
                    assert!(!help.is_empty());
                }
                other => panic!("{knots:?} gave {other:?}"),
            }
        }
        assert!(KnotVector::open_uniform(3, 3).is_err());
    }
}
