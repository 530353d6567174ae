//! Every path of solution on the hardest networks keeps what it promises, or says that it cannot.

use springfit::clock::Progress;
use springfit::report::bench::hard::{self, Row};

fn rows(wanted: &str) -> Vec<Row> {
    hard::run(wanted, &Progress::default()).expect("nobody interrupts")
}

#[test]
fn every_path_keeps_its_promise_or_says_that_it_cannot() {
    for wanted in ["spread 1e12", "spread 1e15", "weak diagonals 1e-9", "coincident", "one element"] {
        let rows = rows(wanted);
        assert!(rows.len() >= 5, "{wanted}: {rows:?}");
        for row in &rows {
            assert!(row.kept, "{row:?}");
            let Some(answer) = row.answer else {
                assert!(!row.words.is_empty(), "{row:?}");
                continue;
            };
            if row.path == "direct" {
                assert!(answer.backward_error <= 1e-15, "{row:?}");
            }
            if let (Some(error), Some(estimated)) = (answer.forward_error, answer.estimated) {
                assert!(error <= 3.0 * estimated, "{row:?}");
                assert_eq!(row.words.contains("warns"), estimated > 1e-6, "{row:?}");
            }
        }
        let text = hard::table(&rows);
        assert!(text.contains(" 0 broken promises") && hard::svg(&rows).contains("</svg>"), "{text}");
    }
}

#[test]
fn a_body_that_is_too_flat_is_a_row_with_its_refusal() {
    let rows = rows("flat box 1e-9");
    assert_eq!(rows.len(), 1, "{rows:?}");
    assert!(rows[0].answer.is_none() && rows[0].words.contains("mechanism"), "{rows:?}");
}
