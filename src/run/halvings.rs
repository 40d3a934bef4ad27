//! Turns that bodies make in a step, and oscillations of formulas: functions are resolved only in parts with
//! few.

use super::observer::Inside;
use crate::dynamics::Time;
use std::f64::consts::TAU;

/// Turns in a part of a step up to which a function that no interpolant resolves there has a corner: of parts
/// with more that is not known.
const FEW: f64 = 1.0;
/// Parts of one step that are halved for it at most.
const MOST: u32 = 1 << 18;

/// Turns that the fastest of so many angles makes in a part of a step, about.
pub(super) fn turns(inside: &mut dyn Inside, angles: usize, (begin, span): (Time, f64)) -> f64 {
    let most = [0.0, 0.5, 1.0].into_iter().fold(0.0, |most: f64, share| {
        let motion = inside.at(begin + share * span);
        motion.omega.iter().take(angles).fold(most, |most, omega| most.max(omega.hi.abs()))
    });
    most * span / TAU
}

/// Halvings of the parts of a step in which no interpolant resolves some functions.
#[derive(Default)]
pub(super) struct Halvings {
    /// Parts halved since the step began beyond the usual number of times.
    count: u32,
}

impl Halvings {
    /// Begins to search a step.
    pub fn begin(&mut self) {
        self.count = 0;
    }

    /// Whether a part is to be halved that comes of so many halvings: up to the usual number, and then as
    /// long as it has many turns of so many angles.
    pub fn asks(
        &mut self,
        inside: &mut dyn Inside,
        angles: usize,
        part: (Time, f64),
        [depth, usual]: [u32; 2],
    ) -> bool {
        depth < usual || turns(inside, angles, part) > FEW && self.go_on()
    }

    /// Counts a part to be halved beyond the usual number of times; false where there are too many.
    pub fn go_on(&mut self) -> bool {
        self.count += 1;
        !self.is_too_much()
    }

    /// True where parts of the step were halved beyond the usual number of times.
    pub fn are_many(&self) -> bool {
        self.count > 0
    }

    /// True where there are more of these parts than are looked at.
    pub fn is_too_much(&self) -> bool {
        self.count > MOST
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dynamics::Motion;

    /// A body that turns at a constant rate.
    struct Turning(Motion);

    impl Inside for Turning {
        fn span(&self) -> (Time, Time) {
            (Time::from(0.0), Time::from(1.0))
        }

        fn at(&mut self, _time: Time) -> &Motion {
            &self.0
        }

        fn roughly_at(&mut self, time: Time) -> &Motion {
            self.at(time)
        }
    }

    #[test]
    fn parts_with_many_turns_are_halved_further_up_to_a_number() {
        let mut inside = Turning(Motion::of_doubles(0.0, [&[0.0], &[-1e9 * TAU]]));
        let mut halvings = Halvings::default();
        let part = |span: f64| (Time::from(0.0), span);
        assert!(halvings.asks(&mut inside, 1, part(1e-10), [3, 4]));
        assert!(!halvings.asks(&mut inside, 1, part(0.9e-9), [4, 4]));
        assert!(halvings.asks(&mut inside, 1, part(1.1e-9), [4, 4]) && !halvings.is_too_much());
        // What is no angle does not turn.
        assert!(!halvings.asks(&mut inside, 0, part(1.0), [4, 4]));
        assert!((1..MOST).all(|_| halvings.asks(&mut inside, 1, part(1.0), [4, 4])));
        assert!(!halvings.asks(&mut inside, 1, part(1.0), [4, 4]) && halvings.is_too_much());
        halvings.begin();
        assert!(!halvings.is_too_much() && !halvings.are_many());
        assert!(halvings.go_on() && halvings.are_many());
    }
}
