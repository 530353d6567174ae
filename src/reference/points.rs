//! Integration points: the one currency between a method and everything that integrates over the body.
//!
//! A body is a list of elements (knot spans, finite elements or smoothing domains). At its integration points q an
//! element knows which nodes act, their shape functions N_a and gradients dN_a/dx, and the volume v_q that the point
//! stands for, so that every integral is a sum:
//!
//! ```text
//!     integral of f(N, dN/dx) dV  =  sum over elements, sum over q of v_q f(N(q), dN/dx(q))
//! ```
//!
//! A method (see [`super::methods`]) differs from another only in how it fills an [`ElementPoints`]. Volumes are in
//! m^3: in two dimensions they contain the thickness. Integrals of N_a N_b (the mass) may need more points than those of
//! the gradients: [`IntegrationPoints::fill_mass`].
//!
//! Elements of the stiffness may overlap, as smoothing domains do. What does not look at gradients (masses, volume, body
//! forces) is integrated over elements that cover the body once, the cells of the mesh: [`IntegrationPoints::of_body`]. So
//! it is the same for every method on that mesh.
//!
//! A method against locking takes the change of volume of an element not from the gradients g_a(q) at a point but from
//! their mean over the element, V = sum_q v_q:
//!
//! ```text
//!     gbar_a = sum_q v_q g_a(q) / V,      tr(e) at every point becomes  sum_a u_a . gbar_a      (B-bar, Hughes 1980)
//! ```
//!
//! [`ElementPoints::mean_gradients`] then holds gbar; it is empty for all other methods.

use rayon::prelude::*;

use crate::error::Result;
use crate::geometry::patch::{Patch, ShapeFunctions};
use crate::reference::material::Lame;

/// Elements handled by one task of a parallel loop: enough to forget the cost of starting it.
const ELEMENTS_PER_TASK: usize = 64;

/// The integration points of one element; reused from element to element.
#[derive(Debug, Clone, Default)]
pub struct ElementPoints {
    /// Volume of each point in m^3.
    pub volumes: Vec<f64>,
    /// Place of each point in m.
    pub positions: Vec<[f64; 3]>,
    /// Shape functions: point q, node a at `q * nodes + a`.
    pub values: Vec<f64>,
    /// Gradients of the shape functions in 1/m, stored like the values; zero in missing directions.
    pub gradients: Vec<[f64; 3]>,
    /// Mean gradients over the element in 1/m, one a node, where the change of volume is taken from them; else empty.
    pub mean_gradients: Vec<[f64; 3]>,
    /// Workspace of the methods that ask a patch for one point at a time.
    pub(super) shape: Option<ShapeFunctions>,
}

impl ElementPoints {
    /// Forgets the points, keeps the memory.
    pub(super) fn clear(&mut self) {
        self.volumes.clear();
        self.positions.clear();
        self.values.clear();
        self.gradients.clear();
        self.mean_gradients.clear();
    }

    /// Writes the mean gradients of the points.
    fn average_gradients(&mut self) {
        let nodes = self.gradients.len() / self.len().max(1);
        let volume: f64 = self.volumes.iter().sum();
        self.mean_gradients.resize(nodes, [0.0; 3]);
        for (q, gradients) in self.gradients.chunks_exact(nodes.max(1)).enumerate() {
            let share = self.volumes[q] / volume;
            for (mean, gradient) in self.mean_gradients.iter_mut().zip(gradients) {
                (0..3).for_each(|a| mean[a] += share * gradient[a]);
            }
        }
    }

    /// sum_a u_a . gbar_a of a displacement (n x 3, m), where the change of volume is taken from it.
    pub fn mean_trace(&self, acting: &[u32], displacement: &[[f64; 3]]) -> Option<f64> {
        let product = |(&node, gradient): (&u32, &[f64; 3])| {
            let u = displacement[node as usize];
            u[0] * gradient[0] + u[1] * gradient[1] + u[2] * gradient[2]
        };
        let means = &self.mean_gradients;
        (!means.is_empty()).then(|| acting.iter().zip(means).map(product).sum())
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.volumes.len()
    }

    /// True before the first fill.
    pub fn is_empty(&self) -> bool {
        self.volumes.is_empty()
    }
}

/// What of the material acts in an element. A method may integrate shear and volume change over different elements that
/// cover the body twice.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// All of it.
    Whole,
    /// mu only.
    Shear,
    /// lambda only.
    Volume,
}

impl Part {
    /// The constants that are left.
    pub fn of(self, lame: Lame) -> Lame {
        match self {
            Self::Whole => lame,
            Self::Shear => Lame { lambda: 0.0, ..lame },
            Self::Volume => Lame { mu: 0.0, ..lame },
        }
    }
}

/// How a method fills the points of one element.
pub(super) type Fill<'a> = Box<dyn Fn(usize, &mut ElementPoints) -> Result<()> + Send + Sync + 'a>;

/// All elements of a body under one method.
pub struct IntegrationPoints<'a> {
    dimension: usize,
    nodes: usize,
    thickness: f64,
    acting: Vec<Vec<u32>>,
    fill: Fill<'a>,
    /// Empty when every element has the whole material.
    parts: Vec<Part>,
    fill_mass: Option<Fill<'a>>,
    /// The elements that cover the body once, where these do not.
    body: Option<Box<Self>>,
    mean_dilatation: bool,
    splines: Option<(&'a Patch, usize)>,
    warnings: Vec<String>,
}

impl<'a> IntegrationPoints<'a> {
    /// A body of `nodes` nodes in `dimension` directions; `acting[e]` lists the nodes that act in element e in the
    /// order in which `fill` writes their shape functions. `thickness` (m) is what `fill` multiplies areas with, 1 in
    /// three dimensions.
    pub(super) fn new(dimension: usize, nodes: usize, thickness: f64, acting: Vec<Vec<u32>>, fill: Fill<'a>) -> Self {
        Self {
            dimension,
            nodes,
            thickness,
            acting,
            fill,
            parts: Vec::new(),
            fill_mass: None,
            body: None,
            mean_dilatation: false,
            splines: None,
            warnings: Vec::new(),
        }
    }

    /// The same elements with other points for integrals of N_a N_b.
    pub(super) fn with_mass_points(mut self, fill: Fill<'a>) -> Self {
        self.fill_mass = Some(fill);
        self
    }

    /// The same elements for the stiffness alone; `body` covers the same nodes once.
    pub(super) fn over_body(mut self, body: Self) -> Self {
        self.body = Some(Box::new(body));
        self
    }

    /// The elements that cover the body once, for masses, volume and body forces: these, or the cells below domains that
    /// overlap.
    pub fn of_body(&self) -> &Self {
        self.body.as_deref().unwrap_or(self)
    }

    /// The same points with the change of volume from the mean gradients of the element.
    pub(super) fn with_mean_dilatation(mut self) -> Self {
        self.mean_dilatation = true;
        self
    }

    /// The same points with a remark for the user.
    pub(super) fn with_warning(mut self, warning: String) -> Self {
        self.warnings.push(warning);
        self
    }

    /// The same points with the part of the material that acts in each element.
    pub(super) fn with_parts(mut self, parts: Vec<Part>) -> Self {
        self.parts = parts;
        self
    }

    /// What of the material acts in an element.
    pub fn part(&self, element: usize) -> Part {
        self.parts.get(element).copied().unwrap_or(Part::Whole)
    }

    /// The same points, known to be those of a patch with `extra` Gauss points beyond degree + 1 in each direction.
    pub(super) fn of_patch(mut self, patch: &'a Patch, extra: usize) -> Self {
        self.splines = Some((patch, extra));
        self
    }

    /// The patch that the points belong to and its Gauss points beyond degree + 1, if they are those of a patch.
    pub fn splines(&self) -> Option<(&'a Patch, usize)> {
        self.splines
    }

    /// What areas are multiplied with in m, 1 in three dimensions.
    pub fn thickness(&self) -> f64 {
        self.thickness
    }

    /// Directions of the body, 2 or 3.
    pub fn dimension(&self) -> usize {
        self.dimension
    }

    /// Number of nodes of the body.
    pub fn nodes(&self) -> usize {
        self.nodes
    }

    /// Number of elements.
    pub fn elements(&self) -> usize {
        self.acting.len()
    }

    /// The nodes that act in an element.
    pub fn acting(&self, element: usize) -> &[u32] {
        &self.acting[element]
    }

    /// What the user should know about this geometry, such as an orientation that was flipped.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// Fills the points of one element. Allocates nothing once `out` has grown.
    ///
    /// # Errors
    /// [`crate::error::Error::FoldedElement`] where the map of the geometry degenerates.
    pub fn fill(&self, element: usize, out: &mut ElementPoints) -> Result<()> {
        (self.fill)(element, out)?;
        if self.mean_dilatation {
            out.average_gradients();
        }
        Ok(())
    }

    /// Fills points that integrate products of two shape functions well; their gradients need not be looked at.
    ///
    /// # Errors
    /// Those of [`IntegrationPoints::fill`].
    pub fn fill_mass(&self, element: usize, out: &mut ElementPoints) -> Result<()> {
        match &self.fill_mass {
            Some(fill) => fill(element, out),
            None => (self.fill)(element, out),
        }
    }

    /// Computes one value an element, in parallel; the values come back in the order of the elements.
    ///
    /// # Errors
    /// Those of [`IntegrationPoints::fill`], of the first element that has one.
    pub(super) fn map<T: Send>(&self, value: impl Fn(usize, &ElementPoints) -> T + Sync) -> Result<Vec<T>> {
        self.map_filled(|element, points| self.fill(element, points), value)
    }

    /// [`IntegrationPoints::map`] on the points of [`IntegrationPoints::fill_mass`].
    ///
    /// # Errors
    /// Those of [`IntegrationPoints::fill`], of the first element that has one.
    pub(super) fn map_mass<T: Send>(&self, value: impl Fn(usize, &ElementPoints) -> T + Sync) -> Result<Vec<T>> {
        self.map_filled(|element, points| self.fill_mass(element, points), value)
    }

    fn map_filled<T: Send>(
        &self,
        fill: impl Fn(usize, &mut ElementPoints) -> Result<()> + Sync,
        value: impl Fn(usize, &ElementPoints) -> T + Sync,
    ) -> Result<Vec<T>> {
        let filled = (0..self.elements()).into_par_iter().with_min_len(ELEMENTS_PER_TASK);
        let values: Vec<Result<T>> = filled
            .map_init(ElementPoints::default, |points, element| {
                fill(element, points)?;
                Ok(value(element, points))
            })
            .collect();
        values.into_iter().collect()
    }

    /// Volume of the body in m^3, area in m^2 in two dimensions, as this quadrature sees it.
    ///
    /// # Errors
    /// Those of [`IntegrationPoints::fill`].
    pub fn measure(&self) -> Result<f64> {
        let volumes = self.of_body().map(|_, points| points.volumes.iter().sum::<f64>())?;
        Ok(volumes.iter().sum::<f64>() / self.thickness)
    }
}

/// du_i/dx_j = sum_a u_a,i dN_a/dx_j at one point.
pub fn displacement_gradient(acting: &[u32], gradients: &[[f64; 3]], displacement: &[[f64; 3]]) -> [[f64; 3]; 3] {
    let mut sums = [[0.0; 3]; 3];
    for (&node, gradient) in acting.iter().zip(gradients) {
        let u = displacement[node as usize];
        for (row, u) in sums.iter_mut().zip(u) {
            for (sum, g) in row.iter_mut().zip(gradient) {
                *sum += u * g;
            }
        }
    }
    sums
}
