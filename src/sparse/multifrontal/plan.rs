//! What a factorisation is told by the pattern alone: fronts, where their updates lie, which rows meet where.

use std::ops::Range;

use faer::sparse::linalg::cholesky::supernodal::SymbolicSupernodalCholesky;

use super::gaps::Gaps;
use super::tasks::{self, Task};

/// The supernodes of a pattern.
pub type Supernodes = SymbolicSupernodalCholesky<u32>;

/// Everything that depends on the pattern only.
#[derive(Debug)]
pub struct Plan {
    /// By their columns.
    pub fronts: Vec<Front>,
    /// By the front that takes the updates, children ascending.
    pub(super) joins: Vec<Join>,
    pub(super) runs: Vec<Run>,
    /// Place in L of every entry of the permuted lower triangle.
    pub(super) targets: Vec<u32>,
    /// In postorder; the last one is the root.
    pub tasks: Vec<Task>,
    /// Numbers of the workspace of updates.
    pub(super) length: usize,
    /// Columns of the widest front.
    pub(super) widest: usize,
}

/// A front: the columns of a supernode and the rows below them.
#[derive(Debug)]
pub struct Front {
    /// First column.
    pub first: usize,
    /// Columns, w.
    pub width: usize,
    /// Rows below, r.
    pub rows: usize,
    /// Place of its first number in L.
    pub values: usize,
    /// Place of its update in the workspace.
    pub update: usize,
    /// Its children, in the joins.
    pub joins: Range<usize>,
}

/// A child in the front of its parent.
#[derive(Debug)]
pub struct Join {
    /// Its front.
    pub child: usize,
    /// Where its rows are, in the runs.
    pub runs: Range<usize>,
}

/// Neighbouring rows of a child that are neighbours in the front of its parent too.
#[derive(Debug, Clone, Copy)]
pub struct Run {
    /// First row in the child's update.
    pub from: u32,
    /// The same row in the front, its columns included.
    pub to: u32,
    /// Rows.
    pub length: u32,
}

impl Front {
    /// w + r.
    pub fn height(&self) -> usize {
        self.width + self.rows
    }

    /// Numbers of its columns of L.
    pub fn entries(&self) -> usize {
        self.width * self.height()
    }

    /// Multiplications and additions of its elimination: w^3 / 3 + w^2 r + w r^2.
    pub fn flops(&self) -> f64 {
        let (w, r) = (self.width as f64, self.rows as f64);
        w * (w * w / 3.0 + w * r + r * r)
    }
}

impl Plan {
    /// Plans factorisations of a permuted lower triangle (first entry of each column, rows) with these supernodes, whose
    /// tree is in postorder. `division` says from which work on, and how finely, the tree is divided.
    pub fn new(supernodes: &Supernodes, starts: &[u32], rows: &[u32], division: tasks::Division) -> Self {
        let parents = parents(supernodes);
        let mut fronts = fronts(supernodes);
        let (joins, runs) = joins(supernodes, &mut fronts, &parents);
        let mut tasks = tasks::divide(&fronts, &parents, division);
        tasks::find_outside(&mut tasks, &parents, supernodes);
        let length = lay_out(&mut fronts, &joins, &mut tasks);
        let targets = targets(supernodes, &fronts, starts, rows);
        let widest = fronts.iter().map(|front| front.width).max().unwrap_or(0);
        Self { fronts, joins, runs, targets, tasks, length, widest }
    }

    /// The first column below a task (or of its own), and the column after its last.
    pub fn columns_of(&self, task: usize) -> (usize, usize) {
        let Task { first_front, ref fronts, .. } = self.tasks[task];
        let end = fronts.end.checked_sub(1).map_or(0, |last| self.fronts[last].first + self.fronts[last].width);
        (self.fronts.get(first_front).map_or(0, |front| front.first), end)
    }
}

/// The supernode that takes the update of each supernode.
fn parents(supernodes: &Supernodes) -> Vec<Option<usize>> {
    let ends = supernodes.supernode_end();
    let holder = |row: u32| ends.partition_point(|&end| end <= row);
    (0..supernodes.n_supernodes()).map(|s| supernodes.supernode(s).pattern().first().map(|&row| holder(row))).collect()
}

fn fronts(supernodes: &Supernodes) -> Vec<Front> {
    let (begin, end) = (supernodes.supernode_begin(), supernodes.supernode_end());
    let front = |s: usize| Front {
        first: begin[s] as usize,
        width: (end[s] - begin[s]) as usize,
        rows: supernodes.supernode(s).pattern().len(),
        values: supernodes.col_ptr_for_val()[s] as usize,
        update: 0,
        joins: 0..0,
    };
    (0..supernodes.n_supernodes()).map(front).collect()
}

/// The children of every front, with their rows there.
fn joins(supernodes: &Supernodes, fronts: &mut [Front], parents: &[Option<usize>]) -> (Vec<Join>, Vec<Run>) {
    let mut children = vec![Vec::new(); fronts.len()];
    for (child, parent) in parents.iter().enumerate() {
        if let Some(parent) = *parent {
            children[parent].push(child);
        }
    }
    let (mut joins, mut runs) = (Vec::new(), Vec::new());
    let mut places = vec![0_u32; supernodes.nrows()];
    for (s, front) in fronts.iter_mut().enumerate() {
        mark(supernodes, s, &mut places);
        let first = joins.len();
        for &child in &children[s] {
            let start = runs.len();
            find_runs(supernodes.supernode(child).pattern(), &places, &mut runs);
            joins.push(Join { child, runs: start..runs.len() });
        }
        front.joins = first..joins.len();
    }
    (joins, runs)
}

/// Writes the place of each unknown in the front of supernode s.
fn mark(supernodes: &Supernodes, s: usize, places: &mut [u32]) {
    let own = supernodes.supernode_begin()[s]..supernodes.supernode_end()[s];
    for (place, row) in own.chain(supernodes.supernode(s).pattern().iter().copied()).enumerate() {
        places[row as usize] = place as u32;
    }
}

/// Cuts the rows of a child into runs.
fn find_runs(rows: &[u32], places: &[u32], runs: &mut Vec<Run>) {
    let start = runs.len();
    for (from, &row) in rows.iter().enumerate() {
        let to = places[row as usize];
        match runs[start..].last_mut() {
            Some(run) if run.to + run.length == to => run.length += 1,
            _ => runs.push(Run { from: from as u32, to, length: 1 }),
        }
    }
}

/// Decides where every update lies: at its birth in the first gap that is large enough, until its parent has taken it. Tasks
/// that may run side by side lie apart; a task may write where those below it have been. Returns the end of the workspace.
fn lay_out(fronts: &mut [Front], joins: &[Join], tasks: &mut [Task]) -> usize {
    let mut end = 0;
    let mut gaps: Vec<Gaps> = Vec::with_capacity(tasks.len());
    for t in 0..tasks.len() {
        let mut own = Gaps::default();
        let mut start = end;
        for &child in &tasks[t].children {
            start = start.min(tasks[child].updates.start);
            own.inherit(std::mem::take(&mut gaps[child]));
        }
        for s in tasks[t].fronts.clone() {
            fronts[s].update = own.take(fronts[s].rows.pow(2), &mut end);
            for join in &joins[fronts[s].joins.clone()] {
                own.give(fronts[join.child].update, fronts[join.child].rows.pow(2));
            }
        }
        tasks[t].updates = start..end;
        gaps.push(own);
    }
    end
}

/// Where each entry of the permuted lower triangle goes in L.
fn targets(supernodes: &Supernodes, fronts: &[Front], starts: &[u32], rows: &[u32]) -> Vec<u32> {
    let mut targets = Vec::with_capacity(rows.len());
    let mut places = vec![0_u32; supernodes.nrows()];
    for (s, front) in fronts.iter().enumerate() {
        mark(supernodes, s, &mut places);
        for j in 0..front.width {
            let column = starts[front.first + j] as usize..starts[front.first + j + 1] as usize;
            let start = front.values + j * front.height();
            targets.extend(rows[column].iter().map(|&row| start as u32 + places[row as usize]));
        }
    }
    targets
}
