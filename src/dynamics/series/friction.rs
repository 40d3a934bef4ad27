//! Dry friction in the series: the forces of places that slide, found with every order.
//!
//! Between its transitions friction is smooth: `tau = c |N|` with `c = sign(s') mu r`.  Accelerations,
//! multipliers and with them the normal forces N are affine in tau, power by power with the same response
//! `N_m = N_m0 + R tau_m`, of which N_m0 is what an order comes to without tau_m:
//!
//! ```text
//! m = 0:    tau_0 = c |N_00 + R tau_0|,  as in every evaluation (module `dynamics::friction`)
//! m > 0:    |N|_m = n·N_m + (Σ_{j=1..m-1} N_j·N_{m-j} - |N|_j |N|_{m-j}) / (2 |N|_0),    n = N_0/|N|_0
//!           (1 - c n R) tau_m = c (n·N_m0 + what is known)
//! ```
//!
//! Where N begins with power k, as at rest without weight, |N| does too from the start of the step on: tau_k
//! is found as tau_0 is, and k takes the place of 0 in what follows.
//!
//! A rail's N is one multiplier with a sign, a wall's never negative: of these |N| is linear.  A joint's
//! follows from Newton's equation of what is beyond it, of which centre c, mass m and applied forces F are
//! series: `N_m = Σ (m+1)(m+2) m c_{m+2} - F_m`.  Each order is solved twice, without tau_m and with it.
//!
//! Numbers of many digits have the normal forces of what sticks as well, by which it is told how long that
//! lasts.
//!
//! N may pass zero in a step, and |N| has a corner there; its series goes on below zero instead, and
//! [`Series::pressing`] tells where.  From there on n of a rail is turned, and N of a joint begins at zero:
//! what rounding has left of it has no direction.

mod at_points;
mod told;

use self::at_points::PointForces;
pub use self::told::Slides;
use super::Series;
use super::coefficient::{SeriesNumber, Terms};
use super::polynomial::copy;
use super::rows::{RowSeries, turning_terms};
use super::user::PowersAt;
use crate::arithmetic::{Complex, Over, Real};
use crate::dynamics::Mechanism;
use crate::dynamics::compile::Body;
use crate::dynamics::constraint::{ConstraintEquation, ConstraintForce, ForceDirection, RowMeasure};
use crate::dynamics::friction::{self, CompiledFriction, FrictionMode, Normal};
use crate::dynamics::point::Point;

/// Share of the time in which a normal force changes by itself below which a zero ahead counts as passed, in
/// doubles.
const PASSED: f64 = 1e-9;
/// Rounds of Newton's iteration on a direction.
const ROUNDS: usize = 12;

/// The places that slide.
#[derive(Clone, Debug)]
pub struct FrictionSeries<T: SeriesNumber> {
    places: Vec<Sliding<T>>,
    /// The places that stick, of numbers of many digits.
    stuck: Vec<Sticking<T>>,
    /// The centre of mass of every body.
    centres: Vec<Point<T::Constant>>,
    /// Forces applied to every body at the present power \[N/s^m\].
    pub applied: Vec<Complex<T>>,
    /// What rows push points with.
    at_points: PointForces<T>,
    /// N of place j by tau of place k.
    response: Vec<Complex<T>>,
    /// R and u of the present power before tau is in them.
    rest: Vec<Complex<T>>,
    bend: Vec<Complex<T>>,
    load: Vec<T>,
    /// Power that friction takes (powers 0…P-1) \[W/s^m\].
    pub lost: Vec<T>,
    /// The determinant of the equations of tau_0.
    regularity: f64,
    /// log2 of the share of the time in which a normal force changes by itself below which a zero ahead
    /// counts as passed.
    passed: f64,
}

/// A place that sticks, and its normal force.
#[derive(Clone, Debug)]
struct Sticking<T: SeriesNumber> {
    friction: CompiledFriction<T::Constant>,
    normal: Vec<Complex<T>>,
}

/// One place and its series.
#[derive(Clone, Debug)]
struct Sliding<T: SeriesNumber> {
    friction: CompiledFriction<T::Constant>,
    /// c.
    coefficient: T,
    /// tau and s'.
    force: Vec<T>,
    speed: Vec<T>,
    /// N, its size, and n.
    normal: Vec<Complex<T>>,
    size: Vec<T>,
    along: Complex<T>,
    /// The first power of N that is not zero.
    lead: Option<usize>,
    /// True where N has just passed zero, or is about to, whatever is left of it.
    is_turned: bool,
}

impl<T: SeriesNumber> Sliding<T> {
    /// True where |N| is N but for a sign.
    fn is_linear(&self) -> bool {
        !matches!(self.friction.normal, Normal::Joint(_))
    }

    /// What power m of |N| has of the powers before, m above zero.
    fn known(&self, m: usize) -> T {
        let Some(lead) = self.lead.filter(|lead| m > lead + 1 && !self.is_linear()) else { return T::ZERO };
        let (normal, size) = (&self.normal, &self.size);
        let sum = (lead + 1..m)
            .fold(T::ZERO, |sum, l| sum + normal[l].dot(normal[m + lead - l]) - size[l] * size[m + lead - l]);
        sum / (size[lead] + size[lead])
    }
}

impl<T: SeriesNumber> FrictionSeries<T> {
    /// Room for the series of what slides; `None` where nothing does.
    pub fn new(terms: &Terms<T::Constant>, order: usize) -> Option<Self> {
        let (mechanism, known) = (terms.structure, terms.friction?);
        let place = |friction: &CompiledFriction<T::Constant>, coefficient: T::Constant| Sliding {
            friction: friction.clone(),
            coefficient: T::constant(coefficient),
            force: Vec::with_capacity(order),
            speed: Vec::with_capacity(order),
            normal: Vec::with_capacity(order),
            size: Vec::with_capacity(order),
            along: Complex::ZERO,
            lead: None,
            is_turned: false,
        };
        let all = || known.places.iter().zip(&mechanism.modes);
        let sliding = all().filter_map(|(friction, mode)| Some(place(friction, mode.coefficient(friction)?)));
        let places: Vec<Sliding<T>> = sliding.collect();
        let sticks = all().filter(|(_, mode)| T::HAS_CONSTANTS && matches!(mode, FrictionMode::Stick(_)));
        let stuck: Vec<Sticking<T>> =
            sticks.map(|(friction, _)| Sticking { friction: friction.clone(), normal: Vec::new() }).collect();
        let centre = |(bar, body): (usize, &Body<T::Constant>)| known.forest.walk(bar, body.centre);
        let (n, f) = (mechanism.coordinates(), places.len());
        (f + stuck.len() > 0).then(|| Self {
            places,
            stuck,
            centres: known.bodies.iter().enumerate().map(centre).collect(),
            applied: vec![Complex::ZERO; mechanism.bodies.len()],
            at_points: PointForces::new(terms, order),
            response: vec![Complex::ZERO; f * f],
            rest: vec![Complex::ZERO; n],
            bend: vec![Complex::ZERO; n],
            load: vec![T::ZERO; n],
            lost: vec![T::ZERO; order],
            regularity: 1.0,
            passed: libm::log2(PASSED),
        })
    }

    /// Adds what the tau below power m put on the elements as these turn to `rest`.
    pub fn geometric_terms(&self, m: usize, z: &[Complex<T>], n: usize, rest: &mut [Complex<T>]) {
        for place in &self.places {
            if let RowMeasure::Place(tangent) = &place.friction.tangent.measure {
                turning_terms(tangent, m, z, n, |l| place.force[l], rest);
            }
        }
    }

    /// Puts tau of one place on the loads and the elements' balance.
    fn push(
        tangent: &ConstraintEquation<T::Constant>,
        tau: T,
        z: &[Complex<T>],
        load: &mut [T],
        rest: &mut [Complex<T>],
    ) {
        match &tangent.measure {
            RowMeasure::Place(place) => {
                place.slopes(z, |k, slope| load[k] -= slope * tau);
                place.gradients(z, |k, gradient| rest[k] += gradient.times(tau));
            }
            RowMeasure::Angle { body, base } => {
                load[*body] -= tau;
                if let Some(base) = base {
                    load[*base] += tau;
                }
            }
        }
    }

    /// Power m of the normal forces, from the powers of the elements up to m+2 and those of all multipliers
    /// and tau.
    fn normals(
        &self,
        terms: &Terms<T::Constant>,
        m: usize,
        z: &[Complex<T>],
        rows: &RowSeries<T>,
    ) -> [Vec<Complex<T>>; 2] {
        let (mechanism, Some(known)) = (terms.structure, terms.friction) else { return Default::default() };
        let n = mechanism.coordinates();
        let newest = &z[(m + 2) * n..(m + 3) * n];
        let factor = T::of(((m + 1) * (m + 2)) as f64);
        let gravity = if m == 0 { Complex::of(known.gravity) } else { Complex::ZERO };
        let mut needed = Vec::with_capacity(self.centres.len());
        for ((centre, body), &applied) in self.centres.iter().zip(known.bodies).zip(&self.applied) {
            let acceleration = centre.turned(newest).times(factor) - gravity;
            needed.push(acceleration.times(T::constant(body.mass)) - applied);
        }
        let mut add = |push: &Option<ConstraintForce<T::Constant>>, multiplier: &dyn Fn(usize) -> T| {
            let Some(push) = push else { return };
            let mut force = Complex::ZERO;
            for l in 0..m + 1 {
                force += direction(push, &z[(m - l) * n..(m - l + 1) * n], m - l).times(multiplier(l));
            }
            if let Some(body) = push.on {
                needed[body] += force;
            }
            if let Some(body) = push.from {
                needed[body] -= force;
            }
        };
        for (i, row) in terms.constraints.iter().enumerate() {
            add(&row.push, &|l| rows.multipliers(l)[i]);
        }
        for place in &self.places {
            add(&place.friction.tangent.push, &|l| place.force[l]);
        }
        self.at_points.add(terms, m, rows, &mut needed);
        let mut carried = Vec::with_capacity(mechanism.joints.len());
        mechanism.pass_on(rows.multipliers(m), &mut needed, &mut carried);
        let normal = |friction: &CompiledFriction<T::Constant>| {
            mechanism.normal_force(friction, rows.multipliers(m), &carried)
        };
        let slide = self.places.iter().map(|place| normal(&place.friction)).collect();
        [slide, self.stuck.iter().map(|place| normal(&place.friction)).collect()]
    }

    /// A tau of the size that forces of the mechanism may have, a power of two: what normal forces have of
    /// one is a difference, and is told to as many digits as these forces are.
    fn test_load(&self, mechanism: &Mechanism, z: &[Complex<T>], rows: &RowSeries<T>) -> f64 {
        let n = mechanism.coordinates();
        let size = |force: Complex<T>| libm::hypot(force.re.value(), force.im.value());
        let of_body = |((centre, body), &applied): ((&Point<T::Constant>, &Body), &Complex<T>)| {
            let acceleration = size(centre.turned(&z[2 * n..3 * n])) * 2.0;
            let weight = libm::hypot(mechanism.gravity.re, mechanism.gravity.im);
            body.mass * (acceleration + weight) + size(applied)
        };
        let bodies = self.centres.iter().zip(&mechanism.bodies).zip(&self.applied).map(of_body);
        let forces = bodies.chain(rows.multipliers(0).iter().map(|multiplier| multiplier.value().abs()));
        let coefficients = self.places.iter().map(|place| place.coefficient.value().abs());
        let most = forces.fold(0.0, f64::max) * coefficients.fold(0.0, f64::max);
        let load = libm::exp2(libm::log2(most).floor());
        if load.is_normal() { load } else { 1.0 }
    }

    /// tau_0 of all places, from the normal forces without them.
    fn begin(&mut self, start: &[Complex<T>]) {
        let f = self.places.len();
        let sliding: Vec<(Normal, T)> =
            self.places.iter().map(|place| (place.friction.normal, place.coefficient)).collect();
        let mut tau = vec![T::ZERO; f];
        self.regularity = friction::forces(&sliding, start, |j, k| self.response[j * f + k], &mut tau);
        for (j, place) in self.places.iter_mut().enumerate() {
            let normal = (0..f).fold(start[j], |sum, k| sum + self.response[j * f + k].times(tau[k]));
            let (size, mut along) = friction::size(place.friction.normal, normal);
            if place.friction.normal == Normal::Rail {
                let is_negative = (normal.re.value() < 0.0) != place.is_turned;
                along = Complex::new(T::of(if is_negative { -1.0 } else { 1.0 }), T::ZERO);
            }
            (place.normal[0], place.size[0], place.along, place.force[0]) = (normal, size, along, tau[j]);
            place.lead = (place.is_linear() || size.value() != 0.0).then_some(0);
            if place.is_turned && !place.is_linear() {
                (place.normal[0], place.size[0], place.force[0]) = (Complex::ZERO, T::ZERO, T::ZERO);
                (place.along, place.lead) = (Complex::ZERO, None);
            }
        }
    }

    /// tau_m of all places, m above zero, likewise.
    fn advance(&mut self, m: usize, start: &[Complex<T>]) {
        let f = self.places.len();
        let known: Vec<T> = self.places.iter().map(|place| place.known(m)).collect();
        let begins = self.places.iter().any(|place| place.lead.is_none());
        // Newton's iteration on the direction of what begins with this power.
        for _ in 0..if begins { ROUNDS } else { 1 } {
            let (mut matrix, mut tau) = (vec![T::ZERO; f * f], vec![T::ZERO; f]);
            for (j, place) in self.places.iter().enumerate() {
                tau[j] = place.coefficient * (known[j] + place.along.dot(start[j]));
                for k in 0..f {
                    matrix[j * f + k] = -(place.coefficient * place.along.dot(self.response[j * f + k]));
                }
                matrix[j * f + j] += T::ONE;
            }
            friction::solve(&mut matrix, &mut tau);
            for (j, place) in self.places.iter_mut().enumerate() {
                let normal = (0..f).fold(start[j], |sum, k| sum + self.response[j * f + k].times(tau[k]));
                (place.normal[m], place.force[m]) = (normal, tau[j]);
                if place.lead.is_none() {
                    place.along = friction::size(place.friction.normal, normal).1;
                }
                place.size[m] = known[j] + place.along.dot(normal);
            }
        }
        for place in &mut self.places {
            place.lead = place.lead.or((place.size[m].value() != 0.0).then_some(m));
        }
    }

    /// Power m of the power that friction takes \[W/s^m\].
    pub fn lose(&mut self, m: usize, z: &[Complex<T>], omega: &[T]) -> T {
        let mut lost = T::ZERO;
        let n = omega.len();
        for place in &mut self.places {
            let speed = match &place.friction.tangent.measure {
                RowMeasure::Angle { body, base } => {
                    base.map_or(omega[*body], |base| omega[*body] - omega[base])
                }
                RowMeasure::Place(tangent) => tangent.power(m + 1, z, n).scale((m + 1) as f64),
            };
            place.speed.push(speed);
            let of_powers = place.force[..=m].iter().zip(place.speed[..=m].iter().rev());
            lost += of_powers.fold(T::ZERO, |sum, (&force, &speed)| sum + force * speed);
        }
        self.lost[m] = lost;
        lost
    }

    /// The first powers from another series.
    pub fn take<U: SeriesNumber>(&mut self, other: &FrictionSeries<U>) {
        copy(&mut self.lost, &other.lost);
        for (place, other) in self.places.iter_mut().zip(&other.places) {
            place.size = other.size.iter().map(|size| T::of(size.value())).collect();
        }
    }
}

/// Power m of the direction of a force, from that of the elements.
fn direction<T: Over<C>, C: Real>(push: &ConstraintForce<C>, z: &[Complex<T>], m: usize) -> Complex<T> {
    match &push.way {
        _ if m == 0 => push.direction(z),
        ForceDirection::Ground(_) => Complex::ZERO,
        ForceDirection::Body(body, direction) => z[*body].turn(*direction),
        ForceDirection::Span(span, length) => span.turned(z).times(T::constant(C::ONE / *length)),
    }
}

impl<T: SeriesNumber> Series<T> {
    /// Order m with the friction of what slides, if anything does.
    #[inline(always)]
    pub(super) fn slide<const N: usize>(&mut self, terms: &Terms<T::Constant>, m: usize) {
        match self.friction.take() {
            None => self.solve::<N>(terms, m),
            Some(friction) => self.slide_with(terms, m, friction),
        }
    }

    /// The same: solved without its tau_m, then with it.
    #[inline(never)]
    fn slide_with(&mut self, terms: &Terms<T::Constant>, m: usize, mut friction: Box<FrictionSeries<T>>) {
        let (n, f) = (self.elements, friction.places.len());
        friction.rest.copy_from_slice(&self.rest[Self::row(m, n)]);
        friction.bend.copy_from_slice(&self.bend);
        friction.load.copy_from_slice(&self.load);
        for place in &mut friction.places {
            if m == 0 {
                [&mut place.force, &mut place.speed, &mut place.size].into_iter().for_each(Vec::clear);
                place.normal.clear();
            }
            place.force.push(T::ZERO);
            place.size.push(T::ZERO);
            place.normal.push(Complex::ZERO);
        }
        let at = PowersAt { time: self.time, phi: &self.phi, z: &self.z, omega: &self.omega, n };
        friction.at_points.advance(terms, m, at, &self.factors.scale);
        self.solve::<0>(terms, m);
        if f > 0 {
            self.find_forces(terms, m, &mut friction);
            self.solve_again(terms, m, &friction);
        }
        if !friction.stuck.is_empty() {
            let [_, normals] = friction.normals(terms, m, &self.z, &self.rows);
            for (place, normal) in friction.stuck.iter_mut().zip(normals) {
                place.normal.truncate(m);
                place.normal.push(normal);
            }
        }
        self.friction = Some(friction);
    }

    /// tau_m, where order m is solved without it.
    fn find_forces(&mut self, terms: &Terms<T::Constant>, m: usize, friction: &mut FrictionSeries<T>) {
        let f = friction.places.len();
        let [start, _] = friction.normals(terms, m, &self.z, &self.rows);
        if m == 0 {
            let load = friction.test_load(terms.structure, &self.z, &self.rows);
            for k in 0..f {
                friction.places[k].force[0] = T::of(load);
                self.solve_again(terms, 0, friction);
                let [normals, _] = friction.normals(terms, 0, &self.z, &self.rows);
                friction.places[k].force[0] = T::ZERO;
                for (j, normal) in normals.into_iter().enumerate() {
                    friction.response[j * f + k] = (normal - start[j]).times(T::of(load.recip()));
                }
            }
            friction.begin(&start);
        } else {
            friction.advance(m, &start);
        }
    }

    /// Order m once more, with tau_m.
    fn solve_again(&mut self, terms: &Terms<T::Constant>, m: usize, friction: &FrictionSeries<T>) {
        let n = self.elements;
        self.bend.copy_from_slice(&friction.bend);
        self.load.copy_from_slice(&friction.load);
        let rest = &mut self.rest[Self::row(m, n)];
        rest.copy_from_slice(&friction.rest);
        for place in &friction.places {
            let (tangent, tau) = (&place.friction.tangent, place.force[m]);
            FrictionSeries::push(tangent, tau, &self.z[..n], &mut self.load, rest);
        }
        self.solve::<0>(terms, m);
    }
}
