//! What `reproduce` says about its numbers: every sentence is made from them, so that none can contradict them.
//!
//! The supports, loads and states of the thesis are lost with its figures. A sentence may therefore say where a printed number
//! lies among ours, and what ours depend on; not why theirs is what it is.

use crate::readable::significant;

/// Numbers this near to each other, relative, are called the same.
const NEAR: f64 = 0.1;

/// A number of ours and what tells it from the others.
pub type Named<'a> = (&'a str, f64);

/// A percentage for a sentence.
fn percent(value: f64) -> String {
    format!("{} %", significant(value, 4))
}

/// Where a printed error lies among ours, both in percent: near one of them, below all, above all, or between.
pub fn place(theirs: f64, ours: &[Named]) -> String {
    let list: Vec<String> = ours.iter().map(|(name, error)| format!("{name}: {}", percent(*error))).collect();
    let list = list.join("; ");
    let apart = |error: f64| (error / theirs - 1.0).abs();
    let nearest = ours.iter().min_by(|a, b| apart(a.1).total_cmp(&apart(b.1)));
    match nearest {
        None => String::new(),
        Some((name, error)) if apart(*error) <= NEAR => {
            format!("theirs, {theirs} %, is within {} % of ours ({name})", significant(100.0 * apart(*error), 2))
        }
        _ if ours.iter().all(|(_, error)| theirs < *error) => format!("theirs, {theirs} %, is below ours ({list})"),
        _ if ours.iter().all(|(_, error)| theirs > *error) => format!("theirs, {theirs} %, is above ours ({list})"),
        _ => format!("theirs, {theirs} %, lies between ours ({list})"),
    }
}

/// A fit of displacements with both weightings, each by Gauss-Newton and, where it was tried, by annealing.
pub fn displacement(theirs: f64, ours: &[Named], annealed: &[Named]) -> String {
    let placed = place(theirs, ours);
    let worst = ours.iter().fold(0.0, |worst: f64, (_, error)| worst.max(*error));
    let best = ours.iter().fold(f64::INFINITY, |best: f64, (_, error)| best.min(*error));
    let by_chance = annealed.iter().fold(0.0, |worst: f64, (_, error)| worst.max(*error));
    match () {
        () if theirs < best * (1.0 - NEAR) => {
            placed + ", the best that our searches find: its problem was another one (supports are lost)"
        }
        () if theirs > worst * (1.0 + NEAR) && annealed.is_empty() => {
            placed + ": supports are lost, or it is no best fit"
        }
        () if theirs > worst * (1.0 + NEAR) && by_chance < theirs => {
            placed + &format!("; annealing gets below it too, {} at most: supports are lost", percent(by_chance))
        }
        () if theirs > worst * (1.0 + NEAR) => {
            placed + &format!("; annealing ends at up to {}: theirs may be one that ended early", percent(by_chance))
        }
        () => placed,
    }
}

/// Answers of an objective that is linear in the stiffness, each solved to its minimum; `lost` is what theirs depends on beside
/// what the answers differ in.
pub fn linear(theirs: f64, ours: &[Named], lost: &str) -> String {
    match ours {
        [] => String::new(),
        _ => format!("{}; each of ours is the exact minimum, {lost} of theirs are lost", place(theirs, ours)),
    }
}

/// The matrix approach under splines beside the displacement approach: e_rms of both in percent, theirs and ours; how far the
/// network gives way under the load over how far the body does; percent of K_ref where no spring is.
pub fn splines(theirs: [f64; 2], ours: [f64; 2], compliance: f64, outside: f64) -> String {
    let [their_ratio, our_ratio] = [theirs, ours].map(|[displacement, matrix]| matrix / displacement);
    let times = |ratio: f64| format!("{} times", significant(ratio, 2));
    let comparison = match (our_ratio > 1.0, their_ratio > 1.0) {
        (true, true) => format!("as in theirs the matrix fit is worse than the displacement fit: {}", times(our_ratio)),
        (false, false) => {
            format!("as in theirs the matrix fit is no worse than the displacement fit: {}", times(our_ratio))
        }
        _ => format!("unlike in theirs the matrix fit has {} the error of the displacement fit", times(our_ratio)),
    };
    let way = if compliance > 1.0 { "soft" } else { "stiff" };
    format!(
        "{comparison} ({} in theirs); the network is too {way}, it gives way {} as far as the body; {} % of K_ref (Frobenius) \
         couples control points that no spring joins",
        times(their_ratio),
        times(compliance),
        significant(outside, 2)
    )
}

/// The recovery of known springs: largest relative error of ours and of theirs.
pub fn recovery(ours: f64, theirs: f64) -> String {
    const EXACT: f64 = 1e-9;
    let theirs = significant(100.0 * theirs, 2);
    match ours <= EXACT {
        true => format!("the problem is linear and its answer exact: ours is off by {ours:.0e}, theirs by {theirs} %"),
        false => {
            format!("the answer is not found: ours is off by {} %, theirs by {theirs} %", significant(100.0 * ours, 2))
        }
    }
}

/// Nodes, springs and groups of a mesh whose drawing is lost.
pub fn mesh(theirs: [usize; 3], ours: [usize; 3]) -> String {
    const WHAT: [&str; 3] = ["nodes", "springs", "groups"];
    let told = |numbers: [usize; 3]| {
        let words: Vec<String> = numbers.iter().zip(WHAT).map(|(number, what)| format!("{number} {what}")).collect();
        words.join(", ")
    };
    match theirs == ours {
        true => format!("ours has the {} printed, but not the drawing, which is lost", told(ours)),
        false => format!("ours has {}, printed are {}; the drawing is lost", told(ours), told(theirs)),
    }
}

/// The smallest stable alpha at a step; none where no alpha makes it stable.
pub fn threshold(theirs: f64, ours: Option<f64>) -> String {
    let ours = ours.map_or("at every alpha".to_owned(), |alpha| format!("below {}", significant(alpha, 4)));
    format!("theirs is unstable below alpha {theirs}, ours {ours}")
}

/// Largest global strain of a push and that of the same force at rest, percent; none where no motion was allowed.
pub fn push(moving: &[f64], at_rest: f64) -> String {
    let [low, high] =
        [moving.iter().copied().fold(f64::INFINITY, f64::min), moving.iter().copied().fold(0.0, f64::max)];
    match moving.is_empty() {
        true => format!("the force at rest strains the springs by {}", percent(at_rest)),
        false => {
            let how = if at_rest > high { "more" } else { "less" };
            format!(
                "the push strains the springs by {} to {} at most, the same force at rest by {how}: {}",
                significant(low, 3),
                percent(high),
                percent(at_rest)
            )
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const OURS: [Named; 2] = [("weighting springs", 2.591), ("weighting cells", 1.128)];

    #[test]
    fn a_printed_number_is_placed_where_it_lies() {
        for (theirs, words) in [
            (1.14, "theirs, 1.14 %, is within 1.1 % of ours (weighting cells)"),
            (0.5, "theirs, 0.5 %, is below ours (weighting springs: 2.591 %; weighting cells: 1.128 %)"),
            (1.8, "theirs, 1.8 %, lies between ours (weighting springs: 2.591 %"),
            (9.0, "theirs, 9 %, is above ours (weighting springs: 2.591 %"),
        ] {
            assert!(place(theirs, &OURS).starts_with(words), "{}", place(theirs, &OURS));
        }
        assert_eq!(place(1.0, &[]), "");
    }

    /// 5.7: annealing as good as Gauss-Newton stood beside "an annealing that stopped early"; 5.6: "below the best fit" beside a fit
    /// with the other weighting that was as good.
    #[test]
    fn the_word_about_a_fit_follows_from_both_searches_and_both_weightings() {
        let annealed = OURS;
        assert!(!displacement(1.14, &OURS, &annealed).contains("annealing"));
        assert!(!displacement(1.14, &OURS, &annealed).contains("below"));
        assert!(displacement(0.5, &OURS, &annealed).contains("its problem was another one"));
        let reached = displacement(9.0, &OURS, &annealed);
        assert!(reached.contains("annealing gets below it too, 2.591 % at most"), "{reached}");
        let missed = displacement(9.0, &OURS, &[("weighting springs", 12.0)]);
        assert!(missed.contains("annealing ends at up to 12.00 %: theirs may be one that ended early"), "{missed}");
        assert!(displacement(9.0, &OURS, &[]).contains("or it is no best fit"));
        assert!(!displacement(1.8, &OURS, &annealed).contains("annealing"));
    }

    #[test]
    fn the_matrix_fit_under_splines_is_told_by_its_own_numbers() {
        let soft = splines([14.28, 337.87], [14.46, 96.25], 1.9, 20.1);
        assert!(
            soft.starts_with("as in theirs the matrix fit is worse") && soft.contains("6.7 times (24 times in theirs)"),
            "{soft}"
        );
        assert!(soft.contains("too soft, it gives way 1.9 times as far") && soft.contains("20 % of K_ref"), "{soft}");
        let better = splines([14.28, 337.87], [14.46, 7.23], 0.8, 20.1);
        assert!(better.starts_with("unlike in theirs") && better.contains("0.50 times the error"), "{better}");
        assert!(better.contains("too stiff, it gives way 0.80 times"), "{better}");
        assert!(splines([2.0, 1.0], [2.0, 1.0], 1.0, 1.0).contains("no worse"));
    }

    #[test]
    fn every_other_sentence_has_both_outcomes() {
        assert!(linear(8.19, &[("full", 5.72), ("off-diagonal", 6.49)], "its support").contains("is above ours"));
        assert!(linear(6.0, &[("full", 5.0), ("off-diagonal", 7.5)], "its support").contains("lies between ours"));
        assert_eq!(linear(6.0, &[], "its support"), "");
        assert!(recovery(7e-16, 0.082).contains("exact: ours is off by 7e-16, theirs by 8.2 %"));
        assert!(recovery(0.03, 0.082).contains("not found: ours is off by 3.0 %"));
        assert!(mesh([101, 328, 6], [101, 328, 6]).contains("ours has the 101 nodes, 328 springs, 6 groups printed"));
        assert!(
            mesh([101, 328, 6], [101, 328, 5]).contains("ours has 101 nodes, 328 springs, 5 groups, printed are 101")
        );
        assert!(threshold(40.0, Some(4.749)).ends_with("below alpha 40, ours below 4.749"));
        assert!(threshold(40.0, None).ends_with("ours at every alpha"));
        assert!(
            push(&[2.1, 2.25], 113.9).ends_with("by 2.10 to 2.250 % at most, the same force at rest by more: 113.9 %")
        );
        assert!(push(&[2.1, 2.25], 1.0).contains("by less: 1.000 %"));
        assert!(push(&[], 1.0).starts_with("the force at rest"));
    }
}
