//! Groups of springs that are near to each other in direction, length and position.
//!
//! Every spring is a point of ten coordinates:
//!
//! | coordinates | of |
//! |---|---|
//! | e_x^2, e_y^2, e_z^2, sqrt2 e_x e_y, sqrt2 e_x e_z, sqrt2 e_y e_z | its local direction e: e and -e are one point |
//! | ln l0 | its rest length |
//! | x, y, z | its middle |
//!
//! e is the unit vector of the step in the grid without its signs where there is a grid, so that it turns with the body and
//! mirrored springs agree; the direction in space elsewhere. Each of the three parts is scaled to a total variance of 1. The
//! k clusters make sum_s |x_s - mean of its cluster|^2 small: seeds by k-means++ (D. Arthur, S. Vassilvitskii, Proc. SODA
//! 2007) from a fixed random stream, then the iteration of S. P. Lloyd (IEEE Trans. Inf. Theory 28, 1982). Same springs,
//! same clusters.

use crate::error::Result;
use crate::rng::Stream;

use super::super::network::{Network, Spring};
use super::{Grouping, Request, collect};

/// Most rounds of Lloyd's iteration.
const ROUNDS: usize = 100;

/// Where the three parts of a point begin and end.
const PARTS: [[usize; 2]; 3] = [[0, 6], [6, 7], [7, 10]];

type Point = [f64; 10];

pub(super) fn by_clusters(network: &Network, request: &Request) -> Result<Grouping> {
    let points = points(network);
    let mut centres = seeds(&points, request.groups);
    let mut nearest = vec![0; points.len()];
    for _ in 0..ROUNDS {
        let before = nearest.clone();
        nearest.iter_mut().zip(&points).for_each(|(nearest, point)| *nearest = closest(&centres, point).0);
        if nearest == before {
            break;
        }
        centres = means(&points, &nearest, &centres);
    }
    Ok(collect(network, &by_length(network, &nearest, centres.len()), &names(centres.len())))
}

fn names(clusters: usize) -> Vec<String> {
    (1..=clusters).map(|a| format!("cluster_{a}")).collect()
}

fn points(network: &Network) -> Vec<Point> {
    let mut points: Vec<Point> = network.springs.iter().map(|spring| point(network, spring)).collect();
    let count = points.len().max(1) as f64;
    for [first, end] in PARTS {
        let mean = |c: usize| points.iter().map(|point| point[c]).sum::<f64>() / count;
        let means: Vec<f64> = (first..end).map(mean).collect();
        let from_mean = |point: &Point| -> f64 { (first..end).map(|c| (point[c] - means[c - first]).powi(2)).sum() };
        let variance = points.iter().map(from_mean).sum::<f64>() / count;
        // springs that agree up to rounding are not told apart
        let size = means.iter().map(|mean| mean * mean).sum::<f64>();
        let scale = if variance > 1e-20 * size { 1.0 / variance.sqrt() } else { 0.0 };
        points.iter_mut().for_each(|point| point[first..end].iter_mut().for_each(|x| *x *= scale));
    }
    points
}

fn point(network: &Network, spring: &Spring) -> Point {
    let step = spring.offset.map(|step| f64::from(step).abs());
    let norm = step.iter().map(|x| x * x).sum::<f64>().sqrt();
    let [x, y, z] = if norm > 0.0 { step.map(|x| x / norm) } else { spring.direction };
    let root = 2.0_f64.sqrt();
    let [a, b] = spring.nodes.map(|node| network.positions[node as usize]);
    let middle = |c: usize| 0.5 * (a[c] + b[c]);
    let turned = [x * x, y * y, z * z, root * x * y, root * x * z, root * y * z];
    let mut point = [0.0; 10];
    point[..6].copy_from_slice(&turned);
    point[6] = spring.length.ln();
    point[7..].copy_from_slice(&[middle(0), middle(1), middle(2)]);
    point
}

fn distance(a: &Point, b: &Point) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum()
}

/// The nearest centre, the first of equals, and the squared distance.
fn closest(centres: &[Point], point: &Point) -> (usize, f64) {
    let distances = centres.iter().map(|centre| distance(centre, point)).enumerate();
    distances.fold((0, f64::INFINITY), |best, next| if next.1 < best.1 { next } else { best })
}

/// k-means++: every further seed is a point drawn with a chance that grows like its squared distance from the seeds so
/// far; fewer when there are not so many different points.
fn seeds(points: &[Point], count: usize) -> Vec<Point> {
    let mut stream = Stream::new(0, 0, 0);
    let mut centres: Vec<Point> = points.first().into_iter().copied().collect();
    let mut far: Vec<f64> = points.iter().map(|point| closest(&centres, point).1).collect();
    while centres.len() < count {
        let total: f64 = far.iter().sum();
        if total.is_nan() || total <= 1e-12 {
            break;
        }
        let mut left = stream.uniform() * total;
        let drawn = far.iter().position(|square| {
            left -= square;
            left < 0.0 && *square > 0.0
        });
        let Some(drawn) = drawn.or_else(|| far.iter().position(|square| *square > 0.0)) else { break };
        centres.push(points[drawn]);
        for (far, point) in far.iter_mut().zip(points) {
            *far = far.min(distance(&points[drawn], point));
        }
    }
    centres
}

/// The mean of every cluster; the old centre where a cluster is empty.
fn means(points: &[Point], nearest: &[usize], old: &[Point]) -> Vec<Point> {
    let mut sums = vec![([0.0; 10], 0_usize); old.len()];
    for (point, &cluster) in points.iter().zip(nearest) {
        let (sum, count) = &mut sums[cluster];
        sum.iter_mut().zip(point).for_each(|(sum, x)| *sum += x);
        *count += 1;
    }
    let mean = |(&(sum, count), old): (&(Point, usize), &Point)| match count {
        0 => *old,
        _ => sum.map(|x| x / count as f64),
    };
    sums.iter().zip(old).map(mean).collect()
}

/// The clusters numbered from that of the shortest springs.
fn by_length(network: &Network, nearest: &[usize], clusters: usize) -> Vec<usize> {
    let mut sums = vec![(0.0, 0_usize); clusters];
    for (spring, &cluster) in network.springs.iter().zip(nearest) {
        sums[cluster].0 += spring.length;
        sums[cluster].1 += 1;
    }
    let mean = |cluster: usize| sums[cluster].0 / sums[cluster].1.max(1) as f64;
    let mut order: Vec<usize> = (0..clusters).collect();
    order.sort_by(|&a, &b| mean(a).total_cmp(&mean(b)).then(a.cmp(&b)));
    let mut number = vec![0; clusters];
    order.iter().enumerate().for_each(|(new, &cluster)| number[cluster] = new);
    nearest.iter().map(|&cluster| number[cluster]).collect()
}
