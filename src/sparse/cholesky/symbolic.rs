//! What a factorisation is told by the pattern alone.

use std::sync::Arc;

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::sparse::SymbolicSparseColMatRef;
use faer::sparse::linalg::cholesky::{simplicial, supernodal};
use nalgebra_sparse::CsrMatrix;

use super::refinement::CHECKED_AT_ONCE;
use crate::error::{Error, Result};
use crate::sparse::multifrontal::{Division, Plan, Supernodes, Workspace};
use crate::sparse::pattern::Pattern;
use crate::sparse::sweep::{COLUMNS_AT_ONCE, Sweep};

/// What depends on the pattern and the elimination order only.
#[derive(Debug)]
pub struct Symbolic {
    order: Vec<u32>,
    starts: Vec<u32>,
    rows: Vec<u32>,
    source: Vec<usize>,
    supernodes: Supernodes,
    plan: Plan,
    factor_flops: f64,
}

impl Symbolic {
    /// Analyses a pattern. `order[k]` is the unknown that is eliminated k-th (a permutation of 0..n). Unknowns that do not
    /// depend on each other may change places: the elimination tree is brought to postorder, which neither adds nor moves
    /// an entry of L between them.
    ///
    /// # Errors
    /// When the factor is too large for 32-bit indices or for memory.
    ///
    /// # Panics
    /// When `order` is not a permutation of the unknowns.
    pub fn analyse(pattern: &Pattern, order: Vec<u32>) -> Result<Arc<Self>> {
        Self::divided(pattern, order, Division::default())
    }

    /// The same with a tree that is divided in another way.
    pub(super) fn divided(pattern: &Pattern, mut order: Vec<u32>, division: Division) -> Result<Arc<Self>> {
        let n = pattern.len();
        loop {
            let rank = inverse(&order, n);
            let (starts, rows, source) = permuted_lower(pattern, &order, &rank);
            let (upper_starts, upper_rows) = transpose_pattern(n, &starts, &rows);
            let upper = SymbolicSparseColMatRef::new_checked(n, n, &upper_starts, None, &upper_rows);
            let (mut etree, mut counts) = (vec![0i32; n], vec![0u32; n]);
            let scratch = StackReq::any_of(&[
                simplicial::prefactorize_symbolic_cholesky_scratch::<u32>(n, upper_rows.len()),
                supernodal::factorize_supernodal_symbolic_cholesky_scratch::<u32>(n),
            ]);
            let mut buffer = MemBuffer::new(scratch);
            let stack = MemStack::new(&mut buffer);
            let tree = simplicial::prefactorize_symbolic_cholesky(&mut etree, &mut counts, upper, stack);
            let work: Vec<f64> = counts.iter().map(|&c| f64::from(c) * f64::from(c)).collect();
            if let Some(postorder) = postorder(tree.into_inner(), &work) {
                order = postorder.into_iter().map(|k| order[k as usize]).collect();
                continue;
            }
            let supernodes =
                supernodal::factorize_supernodal_symbolic_cholesky(upper, tree, &counts, stack, Default::default())
                    .map_err(|_| too_large(n))?;
            let plan = Plan::new(&supernodes, &starts, &rows, division);
            let factor_flops = work.iter().sum();
            return Ok(Arc::new(Self { order, starts, rows, source, supernodes, plan, factor_flops }));
        }
    }

    /// Number of unknowns.
    pub fn len(&self) -> usize {
        self.order.len()
    }

    /// True when there are no unknowns.
    pub fn is_empty(&self) -> bool {
        self.order.is_empty()
    }

    /// The unknown eliminated k-th.
    pub fn order(&self) -> &[u32] {
        &self.order
    }

    /// First entry of each column of the permuted lower triangle; length n + 1.
    pub fn lower_starts(&self) -> &[u32] {
        &self.starts
    }

    /// Row (in elimination order) of each entry of the permuted lower triangle, ascending in each column.
    pub fn lower_rows(&self) -> &[u32] {
        &self.rows
    }

    /// Position of each entry of the permuted lower triangle in the CSR values of the pattern.
    pub(super) fn source(&self) -> &[usize] {
        &self.source
    }

    /// The values of the permuted lower triangle of a matrix on the analysed pattern, in the order of
    /// [`Symbolic::lower_rows`].
    ///
    /// # Panics
    /// When the matrix has fewer entries than the pattern.
    pub fn lower_of(&self, matrix: &CsrMatrix<f64>) -> Vec<f64> {
        self.source.iter().map(|&from| matrix.values()[from]).collect()
    }

    /// The fronts of a factorisation.
    pub(in crate::sparse) fn plan(&self) -> &Plan {
        &self.plan
    }

    /// The supernodes of L, as the factorisations of this room take them.
    pub(in crate::sparse) fn supernodes(&self) -> &Supernodes {
        &self.supernodes
    }

    /// Stored numbers of L, explicit zeros of the supernodes included.
    pub fn factor_entries(&self) -> usize {
        self.supernodes.len_val()
    }

    /// Floating-point operations of one factorisation (sum of squared column counts).
    pub fn factor_flops(&self) -> f64 {
        self.factor_flops
    }

    /// Bytes of one [`super::Factor`] on this pattern.
    pub fn factor_bytes(&self) -> usize {
        8 * (self.factor_entries() + self.rows.len() + (3 + 3 * CHECKED_AT_ONCE + COLUMNS_AT_ONCE) * self.len())
            + Workspace::<f64>::bytes(&self.plan)
            + Sweep::<f64>::bytes(&self.plan, self.len())
    }
}

fn too_large(n: usize) -> Error {
    Error::input(
        "geometry.control_points",
        format!("the Cholesky factor of {n} unknowns is too large to be indexed or stored"),
        "use fewer control points",
    )
}

/// The columns so that those of every subtree are neighbours, the subtree with the most work first (its update waits while the
/// others are made); `None` when they are neighbours already. `parents[k]`: parent of column k, negative for a root.
fn postorder(parents: &[i32], work: &[f64]) -> Option<Vec<u32>> {
    let n = parents.len();
    let mut total = work.to_vec();
    let mut children = vec![Vec::new(); n + 1];
    let mut neighbours = true;
    let mut size = vec![1; n];
    for k in 0..n {
        let parent = usize::try_from(parents[k]).unwrap_or(n);
        children[parent].push(k);
        if parent < n {
            total[parent] += total[k];
            size[parent] += size[k];
        }
    }
    for (k, children) in children[..n].iter().enumerate() {
        // children of a postorder end where the next one begins
        let mut end = k;
        for &child in children.iter().rev() {
            neighbours &= child + 1 == end;
            end -= size[child].min(end);
        }
    }
    if neighbours {
        return None;
    }
    let mut order = Vec::with_capacity(n);
    let mut waiting: Vec<(usize, bool)> = Vec::new();
    let visit = |waiting: &mut Vec<(usize, bool)>, columns: &mut Vec<usize>| {
        columns.sort_by(|&a, &b| total[b].total_cmp(&total[a]));
        waiting.extend(columns.iter().rev().map(|&k| (k, false)));
    };
    visit(&mut waiting, &mut std::mem::take(&mut children[n]));
    while let Some((k, seen)) = waiting.pop() {
        if seen {
            order.push(k as u32);
        } else {
            waiting.push((k, true));
            visit(&mut waiting, &mut std::mem::take(&mut children[k]));
        }
    }
    Some(order)
}

fn inverse(order: &[u32], n: usize) -> Vec<u32> {
    assert_eq!(order.len(), n, "an elimination order has every unknown");
    let mut rank = vec![u32::MAX; n];
    for (k, &i) in order.iter().enumerate() {
        rank[i as usize] = k as u32;
    }
    assert!(!rank.contains(&u32::MAX), "an elimination order has every unknown once");
    rank
}

/// The permuted lower triangle in compressed columns, and for every entry its position in the CSR values of the pattern.
fn permuted_lower(pattern: &Pattern, order: &[u32], rank: &[u32]) -> (Vec<u32>, Vec<u32>, Vec<usize>) {
    let mut starts = vec![0u32];
    let (mut rows, mut source) = (Vec::new(), Vec::new());
    let mut column: Vec<(u32, usize)> = Vec::new();
    for (k, &unknown) in order.iter().enumerate() {
        column.clear();
        let first = pattern.offsets()[unknown as usize];
        for (offset, &other) in pattern.row(unknown as usize).iter().enumerate() {
            if rank[other] as usize >= k {
                column.push((rank[other], first + offset));
            }
        }
        column.sort_unstable();
        rows.extend(column.iter().map(|entry| entry.0));
        source.extend(column.iter().map(|entry| entry.1));
        starts.push(rows.len() as u32);
    }
    (starts, rows, source)
}

fn transpose_pattern(n: usize, starts: &[u32], rows: &[u32]) -> (Vec<u32>, Vec<u32>) {
    let mut upper_starts = vec![0u32; n + 1];
    for &i in rows {
        upper_starts[i as usize + 1] += 1;
    }
    for i in 0..n {
        upper_starts[i + 1] += upper_starts[i];
    }
    let mut next = upper_starts.clone();
    let mut upper_rows = vec![0u32; rows.len()];
    for j in 0..n {
        for &i in &rows[starts[j] as usize..starts[j + 1] as usize] {
            upper_rows[next[i as usize] as usize] = j as u32;
            next[i as usize] += 1;
        }
    }
    (upper_starts, upper_rows)
}
