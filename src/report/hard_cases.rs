//! The hard cases and what happens in each: the table of the README, printed by `springfit list hard-cases`.
//!
//! Every case has a test of its own in tests/hard_cases, whose name stands beside it.

/// A case that breaks programs.
pub struct HardCase {
    /// What is hard.
    pub case: &'static str,
    /// What springfit does.
    pub happens: &'static str,
    /// The test that shows it.
    pub test: &'static str,
}

const fn case(case: &'static str, happens: &'static str, test: &'static str) -> HardCase {
    HardCase { case, happens, test }
}

/// All of them.
pub const HARD_CASES: [HardCase; 28] = [
    case(
        "coincident control points",
        "no spring of zero length is made and their number is told; `merge_seam` ties the nodes",
        "coincident_control_points",
    ),
    case(
        "degenerate pole",
        "integrated inside only, so det J = 0 on the boundary is allowed; converges",
        "degenerate_pole",
    ),
    case("seam", "tied once by `merge_seam`, no spring twice, 6 zero modes when free", "seam"),
    case(
        "left-handed patch",
        "det J < 0 everywhere: flipped, with a warning; mixed signs: refused",
        "left_handed_patch",
    ),
    case("inverted element / folded net", "refused with element, Gauss point and det J (exit 3)", "folded_net"),
    case(
        "nearly flat cell",
        "solved while the estimated error allows it, with a warning above 1e-6; refused as a mechanism or as inaccurate beyond",
        "nearly_flat_cell",
    ),
    case(
        "stiffness spread",
        "backward error at most 1e-15 after one refinement up to 1e12 and beyond; condition and forward error estimated",
        "stiffness_spread",
    ),
    case(
        "near-zero stiffness",
        "0: the springs are absent and mechanisms are looked for; negative or no number: an error; nothing is clamped",
        "near_zero_stiffness",
    ),
    case(
        "mechanism",
        "an error before the work: number of zero modes, loose nodes and their directions (exit 3)",
        "mechanism",
    ),
    case(
        "rigid body",
        "the free slides and turns are counted and named; `support.fix_rigid = true` holds just them",
        "rigid_body",
    ),
    case(
        "all nodes fixed / no load",
        "an error (exit 2): nothing moves, (5.7) would be 0/0",
        "all_nodes_fixed_or_no_load",
    ),
    case(
        "force on a fixed node",
        "a warning with the node; the force is part of the reaction in result.json",
        "force_on_a_fixed_node",
    ),
    case("bad weights", "zero, negative, not a number: an error with the index; 1e-300 is a weight", "bad_weights"),
    case(
        "bad knots",
        "decreasing, miscounted, not open, too multiple: an error with the index; any range is accepted",
        "bad_knots",
    ),
    case("knot multiplicity p inside", "a line of C0, accepted", "knot_multiplicity_inside"),
    case(
        "Poisson ratio",
        "0.5 refused but in plane stress, -1 refused, a warning where the method locks",
        "poisson_ratio",
    ),
    case("NaN/Inf in any number", "refused with line and key (exit 2)", "not_a_number_in_any_field"),
    case("gamma outside (0,1)", "refused; a sweep has at most 1,000 values, counted before", "gamma_outside_its_range"),
    case(
        "overlapping or empty groups",
        "every spring in one group, longest first; groups without springs do not exist",
        "overlapping_or_empty_groups",
    ),
    case(
        "one element / single row",
        "works from one element on; below, the smallest grid is told",
        "one_element_or_single_row",
    ),
    case("size", "refused before it is allocated, with the bytes and what is free (exit 3); `[limits]`", "size"),
    case(
        "time step",
        "refused above the proven limit, with omega_max, the limit and the fastest spring (exit 3)",
        "time_step",
    ),
    case(
        "spring length crosses zero in motion",
        "forces stay finite; a warning with springs, nodes and time",
        "length_crosses_zero",
    ),
    case("interruption", "files are old or new, never half; what cannot be written is named", "interruption"),
    case("threads", "the same bits for any number of threads", "threads"),
    case(
        "factorisation check",
        "every solve is measured; f32 falls back to f64; displacements that stay above 1e-10 are an error",
        "factorisation_check",
    ),
    case("malformed files", "an error with the line; memory bounded by the file; no panic", "malformed_files"),
    case("units", "phi scales with E, the error stays the same to 1e-12", "units"),
];

/// The table in Markdown, as the README has it.
pub fn markdown() -> String {
    let mut text = String::from("| case | what happens |\n|---|---|\n");
    for HardCase { case, happens, .. } in &HARD_CASES {
        text += &format!("| {case} | {happens} |\n");
    }
    text
}
