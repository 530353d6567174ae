//! The elimination tree in pieces that can be worked on side by side.
//!
//! A subtree needs nothing from its neighbours, so disjoint subtrees are independent *tasks*, and what remains of the tree
//! above them is a task for each place where branches meet:
//!
//! ```text
//!            root            a task: fronts of its own, after those of its children
//!          /      \
//!        t5        t6        t1 .. t4: subtrees of at most a share of all work, one thread each
//!       /  \      /  \
//!      t1   t2   t3   t4
//! ```
//!
//! In postorder a subtree is a range of fronts, of columns and of numbers of L. A share is a constant, so the tasks
//! depend on the pattern and not on the number of threads. A long chain of fronts is one task: a front with one branch
//! below joins the task of that branch.

use std::ops::Range;

use super::plan::{Front, Supernodes};

/// How finely a tree is divided.
#[derive(Debug, Clone, Copy)]
pub struct Division {
    /// Work (multiplications and additions) below which the tree stays whole: a few milliseconds.
    pub from: f64,
    /// A subtree with more than this share of the work is divided. Half of all: two branches of the root, whose updates
    /// wait anyway; each further division keeps more updates waiting at once, and took 4 to 7 % more time on one
    /// thread for memory that is met cold. Inside a branch, further threads find the tiles of its large fronts.
    pub share: f64,
    /// Subtrees with less than this share together go with the front above them.
    pub crumbs: f64,
}

impl Default for Division {
    fn default() -> Self {
        Self { from: 2e8, share: 0.5, crumbs: 1.0 / 128.0 }
    }
}

/// A piece of the tree.
#[derive(Debug)]
pub struct Task {
    /// Tasks that come before it, ascending; side by side.
    pub children: Vec<usize>,
    /// Its own fronts, one after the other.
    pub fronts: Range<usize>,
    /// The first task and the first front below it, or its own.
    pub first_task: usize,
    /// See `first_task`.
    pub first_front: usize,
    /// Its stretch of the workspace of updates, those of the tasks below included.
    pub updates: Range<usize>,
    /// Rows of its fronts that belong to tasks above, ascending.
    pub outside: Vec<u32>,
}

/// Divides a tree in postorder: tasks in postorder, the last is the root of all.
pub fn divide(fronts: &[Front], parents: &[Option<usize>], division: Division) -> Vec<Task> {
    let mut work: Vec<f64> = fronts.iter().map(Front::flops).collect();
    let mut children = vec![Vec::new(); fronts.len() + 1];
    for (s, parent) in parents.iter().enumerate() {
        children[parent.unwrap_or(fronts.len())].push(s);
        if let Some(parent) = *parent {
            work[parent] += work[s];
        }
    }
    let total = children[fronts.len()].iter().map(|&root| work[root]).sum::<f64>();
    if total < division.from {
        return vec![task(Vec::new(), 0..fronts.len(), 0)];
    }
    let mut divider = Divider {
        limit: total * division.share,
        crumbs: total * division.crumbs,
        first: first_descendants(parents),
        work,
        holder: vec![None; fronts.len()],
        tasks: Vec::new(),
    };
    for (s, children) in children[..fronts.len()].iter().enumerate() {
        if divider.work[s] > divider.limit {
            let below = divider.gather(children);
            divider.holder[s] = Some(divider.add(below, s + 1));
        }
    }
    let below = divider.gather(&children[fronts.len()]);
    if !matches!(below[..], [Branch { task: Some(_), .. }]) {
        divider.add(below, fronts.len());
    }
    in_postorder(divider.tasks)
}

/// The first front of each subtree.
fn first_descendants(parents: &[Option<usize>]) -> Vec<usize> {
    let mut first: Vec<usize> = (0..parents.len()).collect();
    for (s, parent) in parents.iter().enumerate() {
        if let Some(parent) = *parent {
            first[parent] = first[parent].min(first[s]);
        }
    }
    first
}

fn task(children: Vec<usize>, fronts: Range<usize>, first_front: usize) -> Task {
    Task { children, fronts, first_task: 0, first_front, updates: 0..0, outside: Vec::new() }
}

struct Divider {
    limit: f64,
    crumbs: f64,
    first: Vec<usize>,
    /// Of the subtree of each front.
    work: Vec<f64>,
    /// The task of each front whose subtree is divided.
    holder: Vec<Option<usize>>,
    tasks: Vec<Task>,
}

/// A branch below a front: a task that is there already, or subtrees that make one.
struct Branch {
    task: Option<usize>,
    fronts: Range<usize>,
    work: f64,
}

impl Divider {
    /// The branches at these subtrees: divided ones as they are, others together up to a share.
    fn gather(&self, roots: &[usize]) -> Vec<Branch> {
        let mut branches: Vec<Branch> = Vec::new();
        for &root in roots {
            let (fronts, work) = (self.first[root]..root + 1, self.work[root]);
            match branches.last_mut() {
                Some(last) if self.holder[root].is_none() && last.task.is_none() && last.work + work < self.limit => {
                    last.fronts.end = fronts.end;
                    last.work += work;
                }
                _ => branches.push(Branch { task: self.holder[root], fronts, work }),
            }
        }
        branches
    }

    /// The task of the fronts up to `end` above these branches.
    fn add(&mut self, mut branches: Vec<Branch>, end: usize) -> usize {
        let first_front = branches.first().map_or(end.saturating_sub(1), |branch| branch.fronts.start);
        let mut start = branches.last().map_or(first_front, |branch| branch.fronts.end);
        if branches.last().is_some_and(|last| last.task.is_none() && last.work < self.crumbs) {
            start = branches.pop().expect("it was looked at").fronts.start;
        }
        let children: Vec<usize> = branches.into_iter().map(|branch| self.task_of(branch)).collect();
        if let [only] = children[..] {
            self.tasks[only].fronts.end = end;
            return only;
        }
        self.tasks.push(task(children, start..end, first_front));
        self.tasks.len() - 1
    }

    fn task_of(&mut self, branch: Branch) -> usize {
        branch.task.unwrap_or_else(|| {
            let first = branch.fronts.start;
            self.tasks.push(task(Vec::new(), branch.fronts, first));
            self.tasks.len() - 1
        })
    }
}

/// Numbers tasks by the end of their subtree, so that the tasks below one are a range too.
fn in_postorder(mut tasks: Vec<Task>) -> Vec<Task> {
    let mut order: Vec<usize> = (0..tasks.len()).collect();
    // a root without fronts ends where its last child does and was made last
    order.sort_by_key(|&t| (tasks[t].fronts.end, t));
    let mut rank = vec![0; tasks.len()];
    order.iter().enumerate().for_each(|(new, &old)| rank[old] = new);
    tasks.iter_mut().flat_map(|task| &mut task.children).for_each(|child| *child = rank[*child]);
    let mut sorted: Vec<(usize, Task)> = rank.into_iter().zip(tasks).collect();
    sorted.sort_by_key(|entry| entry.0);
    let mut tasks: Vec<Task> = sorted.into_iter().map(|entry| entry.1).collect();
    for t in 0..tasks.len() {
        tasks[t].first_task = tasks[t].children.first().map_or(t, |&child| tasks[child].first_task);
    }
    tasks
}

/// Finds the rows of each task that belong to tasks above: those of its fronts whose parents are there.
pub fn find_outside(tasks: &mut [Task], parents: &[Option<usize>], supernodes: &Supernodes) {
    for task in tasks.iter_mut().filter(|task| !task.fronts.is_empty()) {
        let end = task.fronts.end;
        let roots = task.fronts.start..end;
        let tops = roots.filter(|&s| parents[s].is_some_and(|parent| parent >= end));
        task.outside = tops.flat_map(|s| supernodes.supernode(s).pattern()).copied().collect();
        task.outside.sort_unstable();
        task.outside.dedup();
    }
}
