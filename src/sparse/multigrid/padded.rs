//! Vectors on a structured grid with a margin, so that a neighbour is a constant step away.
//!
//! Node (i, j, k) of a grid of n_0 x n_1 x n_2 nodes lies at
//!
//! ```text
//! p = base + i s_1 + j s_2 + k,      s_2 = n_2 + 1,   s_1 = (n_1 + 1) s_2
//! ```
//!
//! One empty place ends every row and one empty row ends every plane; they serve as the margin of the next row and plane
//! too. `base` empty places come first and as many last. The neighbour at the offset (a, b, c) is therefore at
//! p + a s_1 + b s_2 + c for every node, those at the ends included: it is a place with zeros there. A stencil is one
//! plain loop, without a case for the boundary.
//!
//! A vector has three components, one after the other, each of [`Padded::len`] places. A grid in two directions is one
//! plane, (1, n_0, n_1), with the third component held.

use rayon::prelude::*;

/// Half of the 26 neighbours of a node: those in its own plane first (4), then those in the next plane (9).
pub const FORWARD: [[i8; 3]; 13] = [
    [0, 0, 1],
    [0, 1, -1],
    [0, 1, 0],
    [0, 1, 1],
    [1, -1, -1],
    [1, -1, 0],
    [1, -1, 1],
    [1, 0, -1],
    [1, 0, 0],
    [1, 0, 1],
    [1, 1, -1],
    [1, 1, 0],
    [1, 1, 1],
];

/// Places that may be read behind the last node, so that a loop can take whole registers.
pub const SPARE: usize = 16;

/// Where the nodes of a grid lie in a vector.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Padded {
    extents: [usize; 3],
    row: usize,
    plane: usize,
    base: usize,
    len: usize,
}

impl Padded {
    /// The layout of a grid of nodes.
    pub fn new(extents: [usize; 3]) -> Self {
        let row = extents[2] + 1;
        let plane = (extents[1] + 1) * row;
        let base = if extents[0] > 1 { plane + row + 1 } else { row + 1 };
        Self { extents, row, plane, base, len: 2 * base + extents[0] * plane + SPARE }
    }

    /// Nodes along each direction.
    pub fn extents(&self) -> [usize; 3] {
        self.extents
    }

    /// Number of nodes.
    pub fn nodes(&self) -> usize {
        self.extents.iter().product()
    }

    /// Places of one component.
    pub fn len(&self) -> usize {
        self.len
    }

    /// True for a grid without nodes.
    pub fn is_empty(&self) -> bool {
        self.nodes() == 0
    }

    /// Places from one row to the next.
    pub fn row(&self) -> usize {
        self.row
    }

    /// Places from one plane to the next.
    pub fn plane(&self) -> usize {
        self.plane
    }

    /// The place of the first node.
    pub fn base(&self) -> usize {
        self.base
    }

    /// The places from the first node to the end of the last plane.
    pub fn body(&self) -> std::ops::Range<usize> {
        self.base..self.base + self.extents[0] * self.plane
    }

    /// The place of a node.
    pub fn at(&self, index: [usize; 3]) -> usize {
        self.base + index[0] * self.plane + index[1] * self.row + index[2]
    }

    /// Places to the neighbour at a forward offset.
    pub fn step(&self, offset: [i8; 3]) -> usize {
        let signed = offset[0] as isize * self.plane as isize + offset[1] as isize * self.row as isize;
        (signed + offset[2] as isize) as usize
    }

    /// The forward offsets that a grid of this shape has: those within the plane where there is one plane only.
    pub fn forward(&self) -> &'static [[i8; 3]] {
        if self.extents[0] > 1 { &FORWARD } else { &FORWARD[..4] }
    }
}

/// The three components of a vector.
pub fn components<T>(v: &[T]) -> [&[T]; 3] {
    let n = v.len() / 3;
    [&v[..n], &v[n..2 * n], &v[2 * n..]]
}

/// The three components of a vector, to be written.
pub fn components_mut<T>(v: &mut [T]) -> [&mut [T]; 3] {
    let n = v.len() / 3;
    let (x, rest) = v.split_at_mut(n);
    let (y, z) = rest.split_at_mut(n);
    [x, y, z]
}

/// The first columns, of n numbers each, of at least so many.
pub fn columns<T, const COLUMNS: usize>(v: &[T], n: usize) -> [&[T]; COLUMNS] {
    std::array::from_fn(|column| &v[column * n..(column + 1) * n])
}

/// The body of a vector cut into pieces of `size` places (the last may be shorter), three components each.
pub fn pieces<'a, T: Send>(
    padded: &Padded,
    v: &'a mut [T],
    size: usize,
) -> impl IndexedParallelIterator<Item = [&'a mut [T]; 3]> + use<'a, T> {
    let body = padded.body();
    let [x, y, z] = components_mut(v);
    let cut = |component: &'a mut [T]| component[body.clone()].par_chunks_mut(size);
    (cut(x), cut(y), cut(z)).into_par_iter().map(|(x, y, z)| [x, y, z])
}

/// A piece of some columns: three components of each.
pub type Piece<'a, T, const COLUMNS: usize> = [[&'a mut [T]; 3]; COLUMNS];

/// Cuts the bodies of vectors, each of some columns one after the other, into strips of about `size` places of one plane,
/// and has `work` done with the first place of every strip and the part of every vector in it, on all threads.
///
/// A stencil reads three planes around a strip. So that they are still in the cache, a task takes the same strip of
/// `PLANES` planes one after the other, and then the next one.
pub fn for_each_strip<T: Send, const VECTORS: usize, const COLUMNS: usize>(
    padded: &Padded,
    vectors: [&mut [T]; VECTORS],
    size: usize,
    work: impl Fn(usize, [Piece<T, COLUMNS>; VECTORS]) + Sync,
) {
    let bodies = vectors.map(|vector| {
        let mut columns = vector.chunks_exact_mut(3 * padded.len());
        [(); COLUMNS].map(|()| components_mut(columns.next().expect("a column")).map(|c| &mut c[padded.body()]))
    });
    // strips of even length, whole registers
    let size = padded.plane.div_ceil(padded.plane.div_ceil(size)).next_multiple_of(SPARE);
    let planes = if padded.extents[0] > PLANES { PLANES } else { 1 };
    halve(padded.base, &Cut { plane: padded.plane, planes, size }, bodies, &work);
}

/// Planes of a task, at most; a grid with fewer is cut plane by plane.
const PLANES: usize = 12;

/// Strips of a task that has one plane.
const STRIPS: usize = 4;

/// How bodies are cut.
struct Cut {
    plane: usize,
    planes: usize,
    size: usize,
}

/// Does the work of all strips of a part of the bodies that begins at a place, in halves.
fn halve<T: Send, const VECTORS: usize, const COLUMNS: usize>(
    start: usize,
    cut: &Cut,
    mut low: [Piece<T, COLUMNS>; VECTORS],
    work: &(impl Fn(usize, [Piece<T, COLUMNS>; VECTORS]) + Sync),
) {
    let count = low[0][0][0].len();
    let unit = if count > cut.plane { cut.plane } else { cut.size };
    if count <= cut.planes * cut.plane && (count > cut.plane || count <= STRIPS * cut.size) {
        return in_turn(start, cut, low, work);
    }
    let middle = count.div_ceil(unit).div_ceil(2) * unit;
    let high = low.each_mut().map(|vector| {
        vector.each_mut().map(|column| {
            column.each_mut().map(|component| {
                let (before, after) = std::mem::take(component).split_at_mut(middle);
                *component = before;
                after
            })
        })
    });
    rayon::join(|| halve(start, cut, low, work), || halve(start + middle, cut, high, work));
}

/// Does the work of the strips of a few planes: one strip of all planes, then the next.
fn in_turn<T, const VECTORS: usize, const COLUMNS: usize>(
    start: usize,
    cut: &Cut,
    mut bodies: [Piece<T, COLUMNS>; VECTORS],
    work: &impl Fn(usize, [Piece<T, COLUMNS>; VECTORS]),
) {
    let count = bodies[0][0][0].len();
    for within in (0..count.min(cut.plane)).step_by(cut.size) {
        for plane in (0..count).step_by(cut.plane) {
            let strip = plane + within..(plane + (within + cut.size).min(cut.plane)).min(count);
            let parts = bodies
                .each_mut()
                .map(|vector| vector.each_mut().map(|column| column.each_mut().map(|part| &mut part[strip.clone()])));
            work(start + strip.start, parts);
        }
    }
}

/// Components that cannot move, as places in ascending order with the component: 4 p + c.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Held(Vec<u32>);

impl Held {
    /// From the free components of every place: bit c of `free[p]` is set when component c can move. Places that are no
    /// node have no bits and are not listed: they hold zeros anyway.
    pub fn new(padded: &Padded, free: &[u8]) -> Self {
        let mut held = Vec::new();
        let [n0, n1, n2] = padded.extents();
        for i in 0..n0 {
            for j in 0..n1 {
                for k in 0..n2 {
                    let p = padded.at([i, j, k]);
                    held.extend((0..3).filter(|c| free[p] & (1 << c) == 0).map(|c| 4 * p as u32 + c));
                }
            }
        }
        Self(held)
    }

    /// Writes zeros at the held components of a piece that starts at the place `start`.
    pub fn clear<T: Default>(&self, start: usize, piece: &mut [&mut [T]; 3]) {
        let end = start + piece[0].len();
        let first = self.0.partition_point(|&held| (held as usize) < 4 * start);
        for &held in self.0[first..].iter().take_while(|&&held| (held as usize) < 4 * end) {
            piece[held as usize % 4][held as usize / 4 - start] = T::default();
        }
    }

    /// Bytes of the list.
    pub fn bytes(&self) -> usize {
        4 * self.0.len()
    }
}
