//! What the series of friction tell: what it takes, what presses, and how what slides moves.

use super::super::{Series, SeriesNumber};
use super::{PASSED, Sliding};
use crate::arithmetic::Complex;
use crate::dynamics::friction::Normal;

/// A place that slides, as series from the start of the step on.
#[derive(Clone, Copy, Debug)]
pub struct Slides<'a, T> {
    /// The relative velocity.
    pub speed: &'a [T],
    /// The size of the normal force, negative from where that passes zero \[N/s^m\].
    pub size: &'a [T],
    /// Where the normal force comes from.
    pub normal: Normal,
}

impl<T: SeriesNumber> Series<T> {
    /// Lets a normal force count as zero where it is log2 of this share of the time in which it changes by
    /// itself away from there.
    pub fn resolve_reversals(&mut self, passed: f64) {
        self.friction.iter_mut().for_each(|friction| friction.passed = passed);
    }

    /// The places that slide, in their order.
    pub fn slides(&self) -> impl Iterator<Item = Slides<'_, T>> {
        let places = self.friction.iter().flat_map(|friction| &friction.places);
        places.map(|place| Slides { speed: &place.speed, size: &place.size, normal: place.friction.normal })
    }

    /// Powers of the normal forces of the places that stick, in their order, of numbers of many digits.
    pub fn sticks(&self) -> impl Iterator<Item = &[Complex<T>]> {
        self.friction.iter().flat_map(|friction| &friction.stuck).map(|place| &place.normal[..])
    }

    /// The determinant of the equations of friction at the start; 1 without any.
    pub fn regularity(&self) -> f64 {
        self.friction.as_ref().map_or(1.0, |friction| friction.regularity)
    }

    /// Powers of the power that friction takes \[W/s^m\]; none where nothing slides.
    pub fn lost(&self) -> &[T] {
        self.friction.as_ref().map_or(&[], |friction| &friction.lost)
    }

    /// Powers of the force that presses every hinge and rail that slides, negative from where it passes zero
    /// \[N/s^m\].
    pub fn pressing(&self) -> impl Iterator<Item = Vec<f64>> {
        let places = self.friction.iter().flat_map(|friction| &friction.places);
        let has_corner = |place: &&Sliding<T>| !matches!(place.friction.normal, Normal::Contact(_));
        places.filter(has_corner).map(|place| place.size.iter().map(|size| size.value()).collect())
    }

    /// Marks the places whose N passes zero here, for an expansion anew; false where there are none.  `unit`
    /// is the mechanism's unit of time \[s\].
    pub(in crate::dynamics::series) fn find_reversals(&mut self, unit: f64) -> bool {
        let mut is_any = false;
        let passed = self.friction.as_ref().map_or(0.0, |friction| friction.passed);
        // The size of many digits may be below all doubles.
        let is_passed = |force: Complex<T>, rate: Complex<T>, natural: f64| {
            let size = |x: Complex<T>| x.re.log2_size().max(x.im.log2_size());
            size(force) - size(rate) < passed + libm::log2(natural)
        };
        for place in self.friction.iter_mut().flat_map(|friction| &mut friction.places) {
            let power = |m: usize| {
                place.normal.get(m).map_or([0.0; 2], |normal| [normal.re.value(), normal.im.value()])
            };
            let [force, rate, bend] = [power(0), power(1), power(2)];
            let of = |m: usize| place.normal.get(m).copied().unwrap_or(Complex::ZERO);
            place.is_turned = match place.friction.normal {
                Normal::Contact(_) => false,
                Normal::Rail => {
                    let natural = if bend[0] == 0.0 { unit } else { unit.min((rate[0] / bend[0]).abs()) };
                    let is_near = match T::HAS_CONSTANTS {
                        true => is_passed(of(0), of(1), natural),
                        false => (force[0] / rate[0]).abs() < PASSED * natural,
                    };
                    place.along.re.value() * rate[0] < 0.0 && is_near
                }
                // Powers beyond the second are those of the direction that rounding has left.
                Normal::Joint(_) if T::HAS_CONSTANTS => {
                    of(0) != Complex::ZERO && is_passed(of(0), of(1), unit)
                }
                Normal::Joint(_) => {
                    let [force, rate] = [force, rate].map(|[x, y]| libm::hypot(x, y));
                    force != 0.0 && force < PASSED * unit * rate
                }
            };
            is_any |= place.is_turned;
        }
        is_any
    }

    /// Forgets which places were marked.
    pub(in crate::dynamics::series) fn forget_reversals(&mut self) {
        let places = self.friction.iter_mut().flat_map(|friction| &mut friction.places);
        places.for_each(|place| place.is_turned = false);
    }
}
