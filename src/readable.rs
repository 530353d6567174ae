//! Numbers and names as people read them: significant digits at any scale, long names made short.
//!
//! A fixed number of decimals suits one scale only: a body of a micron prints as 0.000. What people read has so many
//! *significant digits* instead, plain from 1e-4 to 1e7 and as a power of ten outside:
//!
//! | | 4 digits |
//! |---|---|
//! | 1.0 | `1.000` |
//! | 1250.52 | `1251` |
//! | 123456.7 | `123457` |
//! | 2e-6 | `2.000e-6` |
//! | 0 | `0` |

/// Powers of ten between which a number is written without one.
const PLAIN: std::ops::Range<i32> = -4..7;

/// Digits of a threshold or of a mark on an axis.
const FEW: usize = 5;

/// A number with this many significant digits; all digits before the point are kept. Only zero reads as zero.
pub fn significant(value: f64, digits: usize) -> String {
    if value == 0.0 || !value.is_finite() {
        return if value == 0.0 { "0".into() } else { value.to_string() };
    }
    let rounded = format!("{value:.*e}", digits.max(1) - 1);
    // the exponent after rounding: 9.9996 is 10.00
    let exponent: i32 = rounded.rsplit('e').next().and_then(|text| text.parse().ok()).unwrap_or_default();
    match PLAIN.contains(&exponent) {
        true => format!("{value:.*}", (digits as i32 - 1 - exponent).max(0) as usize),
        false => rounded,
    }
}

/// A number with up to five significant digits and no zeros at its end, for thresholds and marks on axes.
pub fn short(value: f64) -> String {
    let text = significant(value, FEW);
    let (mantissa, power) = text.split_once('e').map_or((&text[..], None), |(mantissa, power)| (mantissa, Some(power)));
    let mantissa = if mantissa.contains('.') { mantissa.trim_end_matches('0').trim_end_matches('.') } else { mantissa };
    power.map_or(mantissa.to_owned(), |power| format!("{mantissa}e{power}"))
}

/// Text of at most `width` characters: a longer one ends in "..." behind a whole word, where that leaves at least half of it.
pub fn shortened(text: &str, width: usize) -> String {
    const CUT: &str = "...";
    if text.chars().count() <= width {
        return text.to_owned();
    }
    let kept: String = text.chars().take(width.saturating_sub(CUT.len() + 1)).collect();
    let words = kept.rsplit_once(' ').map(|(words, _)| words).filter(|words| 2 * words.len() >= kept.len());
    let kept = words.unwrap_or(&kept).trim_end_matches([',', ' ']);
    format!("{kept} {CUT}")
}

/// The name of a group with its number (that of springs.json, from 0), at most `width` characters.
pub fn numbered(number: usize, name: &str, width: usize) -> String {
    shortened(&format!("#{number} {name}"), width)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_are_significant_at_any_scale() {
        let read = |value: f64| significant(value, 4);
        let cases = [
            (1.0, "1.000"),
            (-0.25, "-0.2500"),
            (1250.52, "1251"),
            (123456.7, "123457"),
            (9.9996, "10.00"),
            (9_999_999.9, "1.000e7"),
            (3.2e-4, "0.0003200"),
            (2e-6, "2.000e-6"),
            (-1.23456e12, "-1.235e12"),
            (0.0, "0"),
            (-0.0, "0"),
        ];
        for (value, expected) in cases {
            assert_eq!(read(value), expected, "{value:?}");
        }
        assert_eq!((read(f64::NAN), read(f64::INFINITY)), ("NaN".to_owned(), "inf".to_owned()));
        assert_eq!(
            (significant(1.26, 1), significant(1.26, 2), significant(12.6, 1)),
            ("1".into(), "1.3".into(), "13".into())
        );
    }

    /// What was 0.000 before: every number but zero keeps its first digits.
    #[test]
    fn only_zero_reads_as_zero() {
        for power in -300..300 {
            let value = 3.3333 * 10_f64.powi(power);
            for text in [significant(value, 3), short(value)] {
                let read: f64 = text.parse().expect("a number");
                assert!((read / value - 1.0).abs() < 6e-3, "{value:e} reads {text}");
            }
        }
    }

    #[test]
    fn short_numbers_have_no_zeros_at_their_end() {
        let cases = [(0.1 + 0.2, "0.3"), (2.0, "2"), (-0.0, "0"), (1250.5, "1250.5"), (1.0 / 3.0, "0.33333")];
        let tiny = [(1e-9, "1e-9"), (2.5e-6, "2.5e-6"), (100.0, "100"), (3e8, "3e8"), (200_000.0, "200000")];
        for (value, expected) in cases.into_iter().chain(tiny) {
            assert_eq!(short(value), expected);
        }
    }

    #[test]
    fn long_names_are_cut_behind_a_word() {
        assert_eq!(shortened("edge", 12), "edge");
        assert_eq!(numbered(12, "edge, x < 0.3 or edge, y >= 2", 20), "#12 edge, x < ...");
        assert_eq!(numbered(3, &"x".repeat(200), 20), "#3 xxxxxxxxxxxxx ...");
        assert_eq!(shortened(&"\u{e9}".repeat(30), 10), format!("{} ...", "\u{e9}".repeat(6)));
        for width in 8..60 {
            let text = numbered(7, "edge, 0.1 <= x < 0.3 or body_diagonal, z >= 0.5 or more of the same", width);
            assert!(text.chars().count() <= width && text.starts_with("#7"), "{width}: {text}");
        }
    }
}
