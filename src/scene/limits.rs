//! `[limits]`: what a run may take.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};

use super::check::positive;

/// `[limits]`: a run whose estimate is above one of them is refused before it starts.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Limits {
    /// Largest memory, in bytes or as text such as "4 GB"; default: what is free on the machine.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub memory: Option<Memory>,
    /// Longest time by the estimate of `springfit check`, in s; default: any.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seconds: Option<f64>,
}

/// An amount of memory.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Memory {
    /// Bytes.
    Bytes(u64),
    /// A number with a unit: B, kB, MB, GB, TB (powers of 1000) or KiB, MiB, GiB, TiB (powers of 1024).
    Text(String),
}

/// Units of memory and their bytes.
const UNITS: [(&str, f64); 9] = [
    ("KiB", 1024.0),
    ("MiB", 1_048_576.0),
    ("GiB", 1_073_741_824.0),
    ("TiB", 1_099_511_627_776.0),
    ("kB", 1e3),
    ("MB", 1e6),
    ("GB", 1e9),
    ("TB", 1e12),
    ("B", 1.0),
];

impl Memory {
    /// In bytes.
    ///
    /// # Errors
    /// [`Error::Input`] at `limits.memory` for a text that is no amount above 0.
    pub fn bytes(&self) -> Result<u64> {
        let found = match self {
            Self::Bytes(bytes) => Some(*bytes as f64),
            Self::Text(text) => UNITS.iter().find_map(|(unit, size)| {
                let number: f64 = text.trim().strip_suffix(unit)?.trim().parse().ok()?;
                Some(number * size)
            }),
        };
        match found {
            Some(bytes) if bytes >= 1.0 && bytes < u64::MAX as f64 => Ok(bytes as u64),
            _ => {
                let given = match self {
                    Self::Bytes(bytes) => bytes.to_string(),
                    Self::Text(text) => format!("{text:?}"),
                };
                let help = "give bytes above 0, or a text such as \"4 GB\" or \"512 MiB\"";
                Err(Error::input("limits.memory", format!("{given} is no amount of memory"), help))
            }
        }
    }
}

/// Checks `[limits]`.
///
/// # Errors
/// [`Error::Input`] at the key that cannot be used.
pub(super) fn check(limits: &Limits) -> Result<()> {
    limits.memory.as_ref().map_or(Ok(0), Memory::bytes)?;
    limits.seconds.map_or(Ok(()), |seconds| positive("limits.seconds", seconds))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_is_read_with_its_unit() {
        let bytes = |text: &str| Memory::Text(text.into()).bytes();
        assert_eq!(Memory::Bytes(12).bytes(), Ok(12));
        assert_eq!(bytes("4 GB"), Ok(4_000_000_000));
        assert_eq!(bytes("1.5GiB"), Ok(1_610_612_736));
        assert_eq!(bytes(" 300 B "), Ok(300));
        for wrong in ["", "GB", "4", "-1 GB", "nan GB", "inf B", "1e40 TB", "4 gb", "0 GB"] {
            assert!(bytes(wrong).is_err(), "{wrong}");
        }
        assert!(Memory::Bytes(0).bytes().is_err());
    }
}
