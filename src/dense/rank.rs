//! Which columns of a matrix follow from others, told by QR with column pivoting.
//!
//! ```text
//! A P = Q R,      |R_11| >= |R_22| >= ...
//! ```
//!
//! The next column is always the one that is furthest from the span of those already taken, and |R_kk| is that distance (P.
//! Businger, G. H. Golub, Numer. Math. 7, 1965). Columns are scaled to length 1 before, so that the distance is the part of a column
//! that is its own, whatever its unit. From the first k with |R_kk| at most `tolerance` on, the columns add nothing:
//! with the leading block R_11 of the k - 1 columns that were taken and the block R_12 beside it, each of them is a
//! combination of these,
//!
//! ```text
//! a_j = sum_i c_ij a_i,     c = R_11^-1 R_12      (to the tolerance)
//! ```
//!
//! Without pivoting |R_kk| measures the distance from the columns that happen to stand before, and not even that once one
//! of them is zero: it accuses columns that are independent and acquits others. A factorisation of A^T A would see the
//! square of the distance, and lose it below 1e-8.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::qr::col_pivoting::factor as pivoted;
use faer::linalg::qr::no_pivoting::factor::recommended_block_size;
use faer::linalg::triangular_solve::solve_upper_triangular_in_place;
use faer::{Mat, Par};

use super::dot;

/// A column whose part in a combination is smaller than this, with all of them of length 1, is not in it: the coefficients
/// are no better than the tolerance times the condition of the columns that were taken.
const PART: f64 = 1e-6;

/// The combinations of columns that vanish: one for each column too many, each as the columns that take part in it,
/// ascending. A column that is in none of them is determined whatever the others do. Columns of zeros are left out.
///
/// `matrix` is column-major with `rows` rows; `tolerance` is the distance from the span of others, relative to the
/// length of a column, up to which it counts as one of them.
///
/// # Panics
/// When the matrix has not a whole number of columns.
pub fn combinations(matrix: &[f64], rows: usize, tolerance: f64) -> Vec<Vec<usize>> {
    let columns: Vec<&[f64]> = matrix.chunks_exact(rows).collect();
    assert_eq!(columns.len() * rows, matrix.len(), "a whole number of columns");
    let lengths: Vec<f64> = columns.iter().map(|column| dot(column, column).sqrt()).collect();
    let present: Vec<usize> = (0..columns.len()).filter(|&j| lengths[j] > 0.0).collect();
    if present.is_empty() {
        return vec![];
    }
    let scaled = Mat::from_fn(rows, present.len(), |i, j| columns[present[j]][i] / lengths[present[j]]);
    let (triangle, order) = factored(scaled);
    let largest = triangle.nrows().min(triangle.ncols());
    let rank = (0..largest).find(|&k| triangle[(k, k)].abs() <= tolerance).unwrap_or(largest);
    let mut parts = triangle.get(..rank, rank..).to_owned();
    solve_upper_triangular_in_place(triangle.get(..rank, ..rank), parts.as_mut(), Par::Seq);
    let members = |j: usize| {
        let taken = (0..rank).filter(|&i| parts[(i, j)].abs() > PART).map(|i| present[order[i]]);
        let mut members: Vec<usize> = taken.chain([present[order[rank + j]]]).collect();
        members.sort_unstable();
        members
    };
    (0..parts.ncols()).map(members).collect()
}

/// R (below its diagonal stand the reflections) and the columns in the order in which they were taken.
fn factored(mut matrix: Mat<f64>) -> (Mat<f64>, Vec<usize>) {
    let (rows, columns) = matrix.shape();
    let block = recommended_block_size::<f64>(rows, columns);
    let mut coefficients = Mat::<f64>::zeros(block, rows.min(columns));
    let (mut order, mut inverse) = (vec![0_usize; columns], vec![0_usize; columns]);
    let scratch = pivoted::qr_in_place_scratch::<usize, f64>(rows, columns, block, Par::Seq, Default::default());
    let mut buffer = MemBuffer::new(scratch);
    pivoted::qr_in_place(
        matrix.as_mut(),
        coefficients.as_mut(),
        &mut order,
        &mut inverse,
        Par::Seq,
        MemStack::new(&mut buffer),
        Default::default(),
    );
    (matrix, order)
}

/// Sets that share a member made one; members ascending, sets in the order of their first.
pub fn united(sets: &[Vec<usize>]) -> Vec<Vec<usize>> {
    let mut united: Vec<Vec<usize>> = Vec::new();
    for set in sets {
        let (touched, apart): (Vec<_>, Vec<_>) =
            united.into_iter().partition(|other| other.iter().any(|member| set.contains(member)));
        let mut whole = [touched.concat(), set.clone()].concat();
        whole.sort_unstable();
        whole.dedup();
        united = apart;
        united.push(whole);
    }
    united.sort_by_key(|set| set[0]);
    united
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Stream;

    const ROWS: usize = 40;

    fn random(stream: &mut Stream) -> Vec<f64> {
        (0..ROWS).map(|_| stream.normal()).collect()
    }

    fn sum(a: f64, x: &[f64], b: f64, y: &[f64]) -> Vec<f64> {
        x.iter().zip(y).map(|(x, y)| a * x + b * y).collect()
    }

    #[test]
    fn exactly_the_columns_of_a_combination_are_named_wherever_they_stand() {
        let mut stream = Stream::new(11, 0, 0);
        let [a, b, c, d] = [(); 4].map(|()| random(&mut stream));
        let zero = vec![0.0; ROWS];
        let follows = sum(3.0, &a, -2.0, &b);
        // a column of zeros in front, independent ones between
        let orders: [(&[&Vec<f64>], &[usize]); 3] = [
            (&[&zero, &a, &c, &b, &follows, &d], &[1, 3, 4]),
            (&[&follows, &c, &zero, &d, &b, &a], &[0, 4, 5]),
            (&[&c, &d, &a, &b, &zero], &[]),
        ];
        for (columns, expected) in orders {
            let in_unlike_units = |(j, column): (usize, &&Vec<f64>)| sum(10f64.powi(3 * j as i32), column, 0.0, &zero);
            let matrix: Vec<f64> = columns.iter().enumerate().flat_map(in_unlike_units).collect();
            assert_eq!(combinations(&matrix, ROWS, 1e-10).concat(), expected);
        }
    }

    #[test]
    fn a_column_counts_until_its_own_part_is_below_the_tolerance() {
        let mut stream = Stream::new(12, 0, 0);
        let [a, own] = [(); 2].map(|()| random(&mut stream));
        for (part, dependent) in [(1e-6, false), (1e-8, true), (0.0, true)] {
            let twin = sum(1.0, &a, part, &own);
            assert_eq!(!combinations(&[a.clone(), twin].concat(), ROWS, 1e-7).is_empty(), dependent, "{part}");
        }
    }

    #[test]
    fn more_columns_than_rows_are_too_many() {
        let mut stream = Stream::new(13, 0, 0);
        let wide: Vec<f64> = (0..3 * 5).map(|_| stream.normal()).collect();
        assert_eq!(combinations(&wide, 3, 1e-10).len(), 2);
        assert!(combinations(&[0.0; 6], 3, 1e-10).is_empty());
    }

    #[test]
    fn sets_that_touch_are_united() {
        assert_eq!(united(&[vec![3, 5], vec![0, 1], vec![4, 5]]), [vec![0, 1], vec![3, 4, 5]]);
    }
}
