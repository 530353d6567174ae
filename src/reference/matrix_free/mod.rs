//! Fine meshes: the stiffness of a spline body, applied without being stored.
//!
//! Everything uses that the splines are products of univariate ones. Three directions are kept throughout; a plane body
//! gets one in the middle with a single function that is 1.
//!
//! | file | idea |
//! |---|---|
//! | `direction` | one direction: spans, values of its functions at the Gauss points, derivatives between them |
//! | `lanes` | eight elements side by side: the contractions with small matrices that all else is made of |
//! | `geometry` | the map of the body at every Gauss point: what makes reference derivatives physical ones |
//! | `operator` | K x, element by element, by sum factorisation |
//! | `separable` | the nearest product form of the coefficients, and the preconditioner from it |
//! | `blocks` | one pass over the blocks of K, a few planes at a time |
//! | `sizes` | sqrt(sum K_ij^2), |K|_1 and |K| |u|, from that pass |
//! | [`solve`] | conjugate gradients on all this |
//! | `accuracy` | backward error, condition and forward error of what they find |

mod accuracy;
mod blocks;
mod direction;
mod geometry;
mod lanes;
mod operator;
mod separable;
mod sizes;
pub mod solve;
