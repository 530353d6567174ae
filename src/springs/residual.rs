//! How well displacements satisfy K(phi) u = f, from the springs themselves.
//!
//! K is never formed: r = f - K u is a sum over the springs, and so is |K| |u|, except for the blocks of a node with itself,
//! whose terms cancel before their size is taken:
//!
//! ```text
//! (K u)_p = sum_s k_s (b_s . u) b_s,p        K_pq = -k d d^T between two nodes,   K_pp = sum over the springs of p of k d d^T
//! ```
//!
//! It serves every path of solution with one measure, the componentwise backward error of
//! [`crate::sparse::backward_error`], and what [`crate::sparse::condition`] needs.

use crate::geometry::dofs::FIXED;
use crate::sparse::backward_error::worst_ratio;

use super::members::Members;

/// The residual of a solution and the size of the matrix.
#[derive(Debug, Clone, PartialEq)]
pub struct Residual {
    /// Componentwise backward error.
    pub backward_error: f64,
    /// f - K u, N.
    pub residual: Vec<f64>,
    /// |K| |u| + |f|, N.
    pub scale: Vec<f64>,
    /// The largest sum of the sizes in a row of K, N/m.
    pub norm: f64,
    /// Most entries of a row of K.
    pub longest_row: usize,
}

impl Members {
    /// The residual of K(phi) u = f; `forces` and `u` of length [`Members::unknowns`].
    ///
    /// # Panics
    /// When a slice is shorter, or `phi` has not one number for every group.
    pub fn residual(&self, phi: &[f64], forces: &[f64], u: &[f64]) -> Residual {
        assert_eq!(phi.len(), self.groups(), "one number for every group");
        let n = self.unknowns();
        let (mut residual, mut scale) = (forces.to_vec(), forces.iter().map(|f| f.abs()).collect::<Vec<_>>());
        let (mut sums, mut lengths) = (vec![0.0; n], vec![3_usize; n]);
        let mut own = vec![([0.0; 3], [FIXED; 3]); n];
        let at = |unknown: u32| if unknown == FIXED { 0.0 } else { u[unknown as usize] };
        for (members, &phi) in self.by_group().zip(phi) {
            for member in members {
                let (ends, d, coefficient) = member.parts();
                let k = phi * coefficient;
                let elongation: f64 = (0..3).map(|c| d[c] * (at(ends[1][c]) - at(ends[0][c]))).sum();
                for (end, other, sign) in [(0, 1, 1.0), (1, 0, -1.0)] {
                    for i in (0..3).filter(|&i| ends[end][i] != FIXED) {
                        let p = ends[end][i] as usize;
                        residual[p] += sign * k * elongation * d[i];
                        own[p].1 = ends[end];
                        for j in 0..3 {
                            let entry = k * d[i] * d[j];
                            own[p].0[j] += entry;
                            if ends[other][j] != FIXED {
                                scale[p] += (entry * at(ends[other][j])).abs();
                                sums[p] += entry.abs();
                                lengths[p] += 1;
                            }
                        }
                    }
                }
            }
        }
        for (p, (row, columns)) in own.iter().enumerate() {
            for (entry, &column) in row.iter().zip(columns).filter(|(_, column)| **column != FIXED) {
                scale[p] += (entry * at(column)).abs();
                sums[p] += entry.abs();
            }
        }
        Residual {
            backward_error: worst_ratio(&residual, &scale),
            residual,
            scale,
            norm: sums.into_iter().fold(0.0, f64::max),
            longest_row: lengths.into_iter().max().unwrap_or(0),
        }
    }
}
