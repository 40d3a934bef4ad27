//! Places with friction that rest together where fewer would be enough, as those of all joints of a linkage.
//!
//! Rigid bodies do not tell how such places share a load: many forces tau fit. They rest where any do, and
//! where any do there are some at a vertex of `|tau_j| <= mu0_j N_j`: as many places stick as there are
//! degrees of freedom to hold, and each other one is at its limit, `tau_j = ±mu0_j N_j`, a law of force like
//! that of what slides. As loads change, one that sticks comes to its limit. Then it stays there and one
//! that was at the opposite limit sticks in its place, or all slide. What motors and locks hold needs no
//! friction to rest, and is given none.
//!
//! Source: G. Strang, *Linear Algebra and Its Applications*, 3rd ed. (1988), section 8.2 (vertices).

use super::super::Mechanism;
use super::super::constraint::ConstraintArguments;
use super::super::contact::metric::{ContactMetric, MetricRow};
use super::evidence::Evidence;
use super::{FrictionMode, FrictionMoment, Normal, Transition};

/// Acceleration, over that without constraints, up to which the rest leaves a place still.
const STILL: f64 = 1e-10;
/// Acceleration, in the mechanism's own, below which what motors hold is as good as still: they may stop it
/// smoothly.
const SMOOTH: f64 = 1e-6;

/// What constraints, contacts and places that stick leave to the displacements of places with friction.
pub(super) struct FreeDisplacements<'a> {
    mechanism: &'a Mechanism,
    at: FrictionMoment<'a>,
    rest: Mechanism,
    metric: Option<ContactMetric>,
}

impl<'a> FreeDisplacements<'a> {
    /// With these contacts held and the places in these modes.
    pub fn new(
        mechanism: &'a Mechanism,
        at: FrictionMoment<'a>,
        contacts: &[usize],
        modes: &[FrictionMode],
    ) -> Self {
        let rest = mechanism.moving(contacts, modes);
        let metric = ContactMetric::at(&rest, at.t, at.phi, at.omega);
        Self { mechanism, at, rest, metric }
    }

    /// The displacement of a place.
    fn gradient(&self, place: usize) -> MetricRow {
        let FrictionMoment { t, phi, z, omega } = self.at;
        MetricRow::of(&self.mechanism.frictions[place].tangent, t, ConstraintArguments { phi, z, omega })
    }

    /// True where nothing is left of the displacement of a place.
    pub fn is_held(&self, place: usize) -> bool {
        self.metric.as_ref().is_some_and(|metric| {
            metric.has(&self.rest, &self.mechanism.frictions[place].tangent, &self.gradient(place))
        })
    }

    /// True where a place that is held has no acceleration; of what motors hold less is asked.
    pub fn is_still(&self, place: usize, is_driven: bool) -> bool {
        self.metric.as_ref().is_some_and(|metric| {
            let MetricRow { row, along } = self.gradient(place);
            let column = metric.column(&along);
            let leaving = (column.dot(&metric.acceleration()) + row.convective).abs();
            let size = column.norm() * metric.unconstrained().norm() + row.convective.abs();
            let own = self.mechanism.displacement_unit(place) / self.mechanism.units.time.powi(2);
            leaving <= STILL * size || is_driven && leaving <= SMOOTH * own
        })
    }

    /// True where a place that is held has no velocity once that of the rest is as constraints and contacts
    /// have it.
    pub fn stands(&self, place: usize) -> bool {
        self.metric.as_ref().is_some_and(|metric| {
            let MetricRow { row, along } = self.gradient(place);
            let (column, velocity) = (metric.column(&along), metric.velocity(self.at.omega));
            let own = self.mechanism.speed_unit(place);
            let size = column.norm() * velocity.norm() + row.drive.abs() + own;
            (column.dot(&metric.kept(&velocity)) + row.drive).abs() <= STILL * size
        })
    }

    /// How far a push at one place moves another one: positive where both move alike.
    fn moved(&self, places: [usize; 2]) -> f64 {
        self.metric.as_ref().map_or(0.0, |metric| {
            let [push, moved] = places.map(|place| metric.free(&metric.column(&self.gradient(place).along)));
            push.dot(&moved)
        })
    }
}

impl Mechanism {
    /// The mechanism's own size of a relative displacement \[rad, m\].
    pub(crate) fn displacement_unit(&self, place: usize) -> f64 {
        if self.frictions[place].tangent.is_angle() { 1.0 } else { self.size_of_parts() }
    }

    /// The mechanism's own relative velocity of a place \[rad/s, m/s\].
    pub(crate) fn speed_unit(&self, place: usize) -> f64 {
        self.displacement_unit(place) / self.units.time
    }

    /// What the rest leaves of a place in these modes.
    pub(super) fn room_beside<'a>(
        &'a self,
        at: FrictionMoment<'a>,
        contacts: &[usize],
        modes: &[FrictionMode],
        place: usize,
    ) -> FreeDisplacements<'a> {
        let mut others = modes.to_vec();
        others[place] = FrictionMode::Open;
        FreeDisplacements::new(self, at, contacts, &others)
    }

    /// Relative velocities of all places, zero of those that closed contacts hold: the speed with which a
    /// point has come to its wall, and with it other places move, is taken off.
    pub(super) fn rates_beside(
        &self,
        evidence: &dyn Evidence,
        at: FrictionMoment,
        closed: &[usize],
        rates: &[f64],
    ) -> Vec<f64> {
        let mut rates = rates.to_vec();
        let may_stand = |(number, rate): (usize, &f64)| match self.frictions[number].normal {
            _ if closed.is_empty() || *rate == 0.0 => None,
            Normal::Contact(contact) if !closed.contains(&contact) => None,
            _ => Some(number),
        };
        let may_stand: Vec<usize> = rates.iter().enumerate().filter_map(may_stand).collect();
        if may_stand.is_empty() {
            return rates;
        }
        let room = FreeDisplacements::new(self, at, closed, &vec![FrictionMode::Open; rates.len()]);
        for place in
            may_stand.into_iter().filter(|&place| room.is_held(place) && evidence.stands(place, closed))
        {
            rates[place] = 0.0;
        }
        rates
    }

    /// The signs in which places are pushed to slide: the one that cannot stick any more, and those at their
    /// limits that move on with it.
    pub(super) fn pushed(
        &self,
        at: FrictionMoment,
        before: &[FrictionMode],
        staying: &[usize],
        Transition { breaks, .. }: Transition,
    ) -> Vec<Option<f64>> {
        let mut pushed = vec![None; self.frictions.len()];
        let Some((place, sign)) = breaks else { return pushed };
        pushed[place] = Some(sign);
        let strained = before.iter().enumerate().filter_map(|(number, mode)| match mode {
            FrictionMode::Strained(strain) if number != place => Some((number, *strain)),
            _ => None,
        });
        let strained: Vec<(usize, f64)> = strained.collect();
        if !strained.is_empty() {
            let room = FreeDisplacements::new(self, at, staying, &vec![FrictionMode::Open; before.len()]);
            for (number, strain) in strained {
                if strain * sign * room.moved([place, number]) > 0.0 {
                    pushed[number] = Some(strain);
                }
            }
        }
        pushed
    }

    /// True where motors and locks hold a place.
    #[cfg(feature = "digits")]
    pub(crate) fn is_driven(&self, at: FrictionMoment, place: usize) -> bool {
        FreeDisplacements::new(self, at, &[], &vec![FrictionMode::Open; self.frictions.len()]).is_held(place)
    }

    /// Leaves without friction the places at rest that motors and locks hold.
    pub(super) fn spare_driven(
        &self,
        at: FrictionMoment,
        pushed: &[Option<f64>],
        options: &mut [Vec<FrictionMode>],
    ) {
        let resting = resting(options, pushed);
        if resting.is_empty() {
            return;
        }
        let driven = FreeDisplacements::new(self, at, &[], &vec![FrictionMode::Open; options.len()]);
        for place in resting {
            if driven.is_held(place) {
                options[place] =
                    vec![FrictionMode::Strained(0.0), FrictionMode::Slip(1.0), FrictionMode::Slip(-1.0)];
            }
        }
    }

    /// Adds to the modes of places that rest, and that walls or others at rest hold, those in which they are
    /// at their limits.
    pub(super) fn strain(
        &self,
        at: FrictionMoment,
        closed: &[usize],
        pushed: &[Option<f64>],
        options: &mut [Vec<FrictionMode>],
    ) {
        let mut resting = resting(options, pushed);
        resting.retain(|&place| options[place][0] != FrictionMode::Strained(0.0));
        if resting.len() + closed.len() < 2 {
            return;
        }
        let stuck = |number: usize| FrictionMode::Stick(self.frictions[number].displacement(at.phi, at.z));
        for &place in &resting {
            let is_other = |number: usize| number != place && resting.contains(&number);
            let others: Vec<FrictionMode> = (0..options.len())
                .map(|number| if is_other(number) { stuck(number) } else { FrictionMode::Open })
                .collect();
            if !FreeDisplacements::new(self, at, closed, &others).is_held(place) {
                continue;
            }
            let strained = match pushed[place] {
                Some(sign) => vec![FrictionMode::Strained(sign)],
                None => vec![FrictionMode::Strained(1.0), FrictionMode::Strained(-1.0)],
            };
            let first = usize::from(pushed[place].is_none());
            options[place].splice(first..first, strained);
        }
    }
}

/// The places that may rest.
fn resting(options: &[Vec<FrictionMode>], pushed: &[Option<f64>]) -> Vec<usize> {
    let rests = |number: &usize| options[*number].len() > 1 || pushed[*number].is_some();
    (0..options.len()).filter(rests).collect()
}
