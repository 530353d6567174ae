//! The networks that a walk tried, and the one that a budget takes: error against the time of a step.

use serde::{Deserialize, Serialize};

use crate::scene;

/// A network that was tried.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Point {
    /// Control points along each direction.
    pub control_points: Vec<usize>,
    /// Number of groups.
    pub groups: usize,
    /// Springs that have a stiffness, with the most groups that were tried at this resolution.
    pub springs: usize,
    /// e_rms over the fitted load cases, percent.
    pub fitted: f64,
    /// e_rms that the budget is about, percent.
    pub error: f64,
    /// Seconds of one explicit step with all threads.
    pub step_seconds: f64,
    /// Seconds of the calibration up to here.
    pub calibration_seconds: f64,
}

/// All networks that were tried.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Front {
    /// The points, in the order in which they were tried.
    pub points: Vec<Point>,
    /// Resolutions that were left out, and why.
    pub skipped: Vec<(Vec<usize>, String)>,
}

impl Front {
    /// Which points no other beats in both error and step time (the fewer groups win a tie).
    pub fn pareto(&self) -> Vec<bool> {
        let beats = |a: &Point, b: &Point| {
            let no_worse = a.error <= b.error && a.step_seconds <= b.step_seconds && a.groups <= b.groups;
            no_worse && (a.error < b.error || a.step_seconds < b.step_seconds || a.groups < b.groups)
        };
        self.points.iter().map(|point| !self.points.iter().any(|other| beats(other, point))).collect()
    }

    /// The point to take: of those within the budget the fastest step, then the fewest groups, then the smallest error;
    /// without one the smallest error within the step time, or the fastest step; and whether it meets the budget.
    pub(super) fn choose(&self, budget: &scene::Budget) -> Option<(usize, bool)> {
        let limit = budget.step_time.unwrap_or(f64::INFINITY);
        let all = || self.points.iter().enumerate();
        let fast = || all().filter(|(_, point)| point.step_seconds <= limit);
        let cheapest = fast().filter(|(_, point)| point.error <= budget.max_error).min_by(|(_, a), (_, b)| {
            a.step_seconds.total_cmp(&b.step_seconds).then(a.groups.cmp(&b.groups)).then(a.error.total_cmp(&b.error))
        });
        let best = || fast().min_by(|(_, a), (_, b)| a.error.total_cmp(&b.error));
        let fastest = || all().min_by(|(_, a), (_, b)| a.step_seconds.total_cmp(&b.step_seconds));
        let chosen = cheapest.or_else(best).or_else(fastest)?;
        Some((chosen.0, cheapest.is_some()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(groups: usize, error: f64, step_seconds: f64) -> Point {
        let (control_points, springs, fitted) = (vec![3, 3], 20, 0.5 * error);
        Point { control_points, groups, springs, fitted, error, step_seconds, calibration_seconds: 1.0 }
    }

    fn front() -> Front {
        let points = vec![
            point(4, 6.0, 1e-6),
            point(8, 4.0, 1e-6),
            point(16, 4.5, 1e-6),
            point(4, 2.5, 3e-6),
            point(8, 2.0, 3e-6),
            point(4, 2.2, 9e-6),
        ];
        Front { points, skipped: vec![] }
    }

    #[test]
    fn a_point_is_on_the_front_when_no_other_is_as_good_in_all_and_better_in_one() {
        // 16 groups with 4.5 % lose to 8 with 4 %; 2.2 % at 9e-6 s with 4 groups loses to nothing with so few groups
        assert_eq!(front().pareto(), [true, true, false, true, true, true]);
    }

    #[test]
    fn the_cheapest_network_within_the_budget_is_taken_and_the_best_without_one() {
        let budget = |max_error, step_time| scene::Budget { max_error, step_time, finest: None };
        let choose = |max_error, step_time| front().choose(&budget(max_error, step_time)).unwrap();
        assert_eq!(choose(3.0, None), (3, true));
        assert_eq!(choose(2.1, None), (4, true));
        assert_eq!(choose(5.0, Some(2e-6)), (1, true));
        assert_eq!(choose(1.0, Some(5e-6)), (4, false));
        assert_eq!(choose(3.0, Some(2e-6)), (1, false));
        assert_eq!(choose(3.0, Some(1e-7)), (0, false));
        assert!(Front::default().choose(&budget(1.0, None)).is_none());
    }
}
