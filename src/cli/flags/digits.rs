//! Options of runs in many digits.

use super::number;
use super::values::{positive, whole};
use clap::Args;

/// How many digits a run carries.
#[derive(Clone, Debug, Default, Args)]
#[command(next_help_heading = "Digits")]
pub struct DigitsFlags {
    /// Carry so many significant decimal digits, 20 to 2000, by taylor's series; the numbers of the scene are
    /// taken exactly as written
    #[arg(long, value_name = "D", value_parser = digits, allow_hyphen_values = true, group = "carried")]
    pub digits: Option<usize>,
    /// Write so many digits of every number [default: those carried, or those known and 3 more]
    #[arg(long, value_name = "N", value_parser = shown, allow_hyphen_values = true, requires = "carried")]
    pub show_digits: Option<u16>,
    /// Choose the digits so that the path is known up to this time in seconds, and prove it by a second run
    /// with more digits and another order; exit code 0 only where both agree
    #[arg(long, value_name = "S", value_parser = number, allow_hyphen_values = true,
        conflicts_with_all = ["digits", "until"], group = "carried")]
    pub trusted_until: Option<f64>,
    /// How near the two runs must be, in rad, m and their rates [default: 1e-3]
    #[arg(long, value_name = "E", value_parser = positive, allow_hyphen_values = true,
        requires = "trusted_until")]
    pub within: Option<f64>,
}

impl DigitsFlags {
    /// True where many digits are asked for.
    pub fn is_asked(&self) -> bool {
        self.digits.is_some() || self.trusted_until.is_some()
    }
}

/// A number of digits to be written.
fn shown(text: &str) -> Result<u16, String> {
    whole(text, [1, 2000]).map(|digits| digits as u16)
}

/// A number of digits.
fn digits(text: &str) -> Result<usize, String> {
    let range = crate::run::digits::DIGITS;
    text.parse()
        .ok()
        .filter(|digits| range.contains(digits))
        .ok_or_else(|| format!("a whole number of digits from {} to {}", range.start(), range.end()))
}
