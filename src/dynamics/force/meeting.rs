//! Springs whose two ends can meet on the way: their force has no direction there.

use super::CompiledSpring;
use super::span::SpanLaw;
use crate::arithmetic::Complex;
use crate::dynamics::point::Point;
use crate::dynamics::{BodyAngles, Mechanism};

/// A length below this share of the free length is none.
const NONE: f64 = 1e-6;
/// The same of the reach of the ends, for laws that know no free length; powers about shorter ones, which
/// grow with their inverse, are rounding or too large for doubles.
const NONE_OF_REACH: f64 = 1e-7;

/// The span of a spring, built-in or by a formula, whose ends can meet.
#[derive(Clone, Debug)]
pub(crate) struct MeetingSpan {
    /// Name of the spring in the scene.
    pub name: String,
    span: Point,
    /// A length that counts as none \[m\]; zero where the force vanishes with the length.
    pub none: f64,
    /// The least length a series is taken from as from another one \[m\].
    pub least: f64,
}

impl MeetingSpan {
    /// Those of a mechanism.
    pub fn all(mechanism: &Mechanism) -> Vec<Self> {
        let unit = mechanism.units.length;
        let laws = mechanism.forces.iter().filter_map(|force| Some((&force.name, force.span.as_deref()?)));
        let laws = laws.filter_map(|(name, law)| Self::of_law(name, law, unit));
        mechanism.springs.iter().filter_map(|spring| Self::of_spring(spring, unit)).chain(laws).collect()
    }

    fn of_spring(spring: &CompiledSpring, unit: f64) -> Option<Self> {
        let pulls = spring.needs_length() && (spring.stiffness > 0.0 || spring.damping > 0.0);
        (pulls && can_vanish(&spring.span)).then(|| Self {
            name: spring.name.clone(),
            span: spring.span.clone(),
            none: NONE * spring.free_length,
            least: least(&spring.span, unit),
        })
    }

    fn of_law(name: &str, law: &SpanLaw, unit: f64) -> Option<Self> {
        can_vanish(&law.span).then(|| {
            let least = least(&law.span, unit);
            let none = if law.tension_without_length() == 0.0 { 0.0 } else { least };
            Self { name: name.to_owned(), span: law.span.clone(), none, least }
        })
    }

    /// D and D' \[m, m/s\] of a mechanism of so many bodies; `z` is room.
    pub fn ends(&self, bodies: usize, at: &BodyAngles, z: &mut Vec<Complex<f64>>) -> [Complex<f64>; 2] {
        z.clear();
        z.extend(at.phi[..bodies].iter().map(|&phi| Complex::unit(phi)));
        // The translational coordinates of bodies that hang on nothing are where the first of their
        // coordinates is.
        z.extend(
            (bodies..at.phi.len())
                .map(|x| Complex::new(at.phi[x], at.phi.get(x + 1).copied().unwrap_or_default())),
        );
        [self.span.position(z), self.span.velocity(z, &at.omega)]
    }
}

/// True where the ends may meet in a step of so many seconds, by D and D' at its two ends, if they are at
/// most twice as fast on the way as there.
pub(crate) fn can_meet(a: [Complex<f64>; 2], b: [Complex<f64>; 2], time: f64) -> bool {
    let size = |x: Complex<f64>| x.norm_squared().sqrt();
    let reach = time * (size(a[1]).max(size(b[1])) + size(b[1] - a[1]));
    let nearest = size(a[0]).min(size(b[0]));
    nearest <= reach || reach.is_nan()
}

/// The lengths a span is made of \[m\].
fn lengths(span: &Point) -> impl Iterator<Item = f64> {
    let parts = std::iter::once(&span.root).chain(span.terms.iter().map(|term| &term.1));
    parts.map(|part| part.norm_squared().sqrt())
}

/// A length that is none beside those a span is made of, or the unit of length \[m\].
fn least(span: &Point, unit: f64) -> f64 {
    let reach: f64 = lengths(span).sum();
    NONE_OF_REACH * if reach > 0.0 { reach } else { unit }
}

/// True where a span can have no length.
fn can_vanish(span: &Point) -> bool {
    let (all, most) = (lengths(span).sum::<f64>(), lengths(span).fold(0.0, f64::max));
    // Rounding must not open a gap that is none.
    !span.shifts.is_empty() || 2.0 * most <= all * (1.0 + 1e-9)
}
