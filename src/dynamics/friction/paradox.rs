//! Why no motion fits dry friction, or more than one.

/// Why there is no way on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Paradox {
    /// No combination fits: Painlevé's inconsistent case.
    Inconsistent,
    /// The point may stay on its walls as well as leave one of them: Painlevé's indeterminate case.
    Indeterminate,
    /// Too many places touch without sliding.
    TooMany(usize),
}

impl Paradox {
    /// What it says of places with these names.
    pub fn message(&self, places: &str) -> String {
        match self {
            Self::Inconsistent => {
                format!("no forces of friction fit the motion at {places}: Painlevé's inconsistent case")
            }
            Self::Indeterminate => {
                format!("more than one motion fits friction at {places}: Painlevé's indeterminate case")
            }
            Self::TooMany(count) => {
                format!("{count} places with friction are at rest at once, more than are taken")
            }
        }
    }
}

/// What to do about one.
pub const HINT: &str = "lower the coefficient, or put a spring and a damper where the bodies touch";
/// What is said where the equations of friction become singular.
pub const JAMS: &str = "friction no longer follows from the motion: Painlevé's paradox, the surfaces jam";
/// The determinant of the equations of friction from which on it is far from zero: 1 is that of no friction.
pub const REGULAR: f64 = 0.3;
/// The same below which ever smaller steps are that paradox.
pub const JAMMED: f64 = 1e-2;
