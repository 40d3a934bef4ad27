//! Forces from outside the crate, written once and exact in every method.
//!
//! A [`Force`] is run once, on symbols; what it does is kept as a [`Tape`], which the equations evaluate on
//! plain numbers, on double-double, on dual numbers (Jacobians, growth of errors), on lanes (stages of Gauss
//! methods) and as power series.  The potential is differentiated on the tape:
//!
//! ```text
//! F_P = -∂V/∂P  at every point it depends on,
//!     torque = -∂V/∂q - (-sin q ∂V/∂cos q + cos q ∂V/∂sin q)  on every body
//! power accounted as work = Σ F·P' + Σ torque w  of what is applied beside
//! ```

use super::span::SpanLaw;
use crate::arithmetic::tape::{Slot, Tape};
use crate::arithmetic::{Complex, Over, Real, Scalar};
use crate::dynamics::configuration::Configuration;
use crate::dynamics::constraint::{ConstraintArguments, Site};
use crate::dynamics::fingerprint::Hash;
use crate::dynamics::point::Point;

/// A force or torque that acts on a mechanism, beside those a scene knows.
///
/// Written over the scalar trait, it works in every method that takes forces of its kind; it cannot branch on
/// values.  RATTLE takes potentials of positions and directions only.
///
/// ```
/// use driftless::arithmetic::Scalar;
/// use driftless::dynamics::force::{Force, Loads};
/// use driftless::Site;
/// use driftless::dynamics::Configuration;
///
/// /// Drag against the square of the speed, and a Duffing spring from the same point to the ground.
/// struct Plate {
///     tip: Site,
///     drag: f64,
///     stiffness: f64,
/// }
///
/// impl Force for Plate {
///     fn name(&self) -> &str {
///         "plate"
///     }
///
///     fn potential<S: Scalar>(&self, at: &Configuration<S>) -> S {
///         let [x, y] = at.position(&self.tip);
///         let square = x * x + y * y;
///         square.scale(0.5 * self.stiffness) + (square * square).scale(0.25 * self.stiffness)
///     }
///
///     fn apply<S: Scalar>(&self, at: &Configuration<S>, loads: &mut Loads<S>) {
///         let [vx, vy] = at.velocity(&self.tip);
///         let speed = (vx * vx + vy * vy + S::of(1e-12)).sqrt().scale(-self.drag);
///         loads.force(&self.tip, [vx * speed, vy * speed]);
///     }
/// }
/// ```
pub trait Force {
    /// Name in messages and reports.
    fn name(&self) -> &str;

    /// Potential energy \[J\]; its gradient acts on the mechanism, and the energy balance keeps it.  It must
    /// depend on neither time nor rates.
    fn potential<S: Scalar>(&self, _at: &Configuration<S>) -> S {
        S::ZERO
    }

    /// Adds forces and torques beside those of the potential; their work is accounted for.
    fn apply<S: Scalar>(&self, _at: &Configuration<S>, _loads: &mut Loads<S>) {}
}

/// Forces and torques that act at one moment.
#[derive(Clone, Debug, Default)]
pub struct Loads<S, C = f64> {
    pub(super) forces: Vec<(Site<C>, [S; 2])>,
    pub(super) torques: Vec<(usize, S)>,
}

impl<S: Scalar, C: Clone> Loads<S, C> {
    /// Adds a force \[N\] at a point; at a point of the ground it does nothing.
    pub fn force(&mut self, site: &Site<C>, force: [S; 2]) {
        if site.body.is_some() {
            self.forces.push((site.clone(), force));
        }
    }

    /// Adds a torque \[N·m\] on a body; the opposite one on another body or the ground is for the caller to
    /// add.
    pub fn torque(&mut self, body: usize, torque: S) {
        self.torques.push((body, torque));
    }
}

/// What an input of the tape is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::dynamics) enum ForceInput {
    /// A number that is no double.
    Number(usize),
    Time,
    Angle(usize),
    Rate(usize),
    Cosine(usize),
    Sine(usize),
    X(usize),
    Y(usize),
    XRate(usize),
    YRate(usize),
}

/// Forces and torques as results of a tape.
#[derive(Clone, Debug, Default, PartialEq)]
pub(in crate::dynamics) struct ForceTape {
    pub tape: Tape,
    /// Sites and both components \[N\].
    pub forces: Vec<(usize, [Slot; 2])>,
    /// Bodies \[N·m\].
    pub torques: Vec<(usize, Slot)>,
    /// Power accounted as work \[W\].
    pub power: Option<Slot>,
}

/// A recorded force.
#[derive(Clone, Debug, PartialEq)]
pub struct UserForce<C = f64> {
    /// Name in messages.
    pub name: String,
    pub(in crate::dynamics) inputs: Vec<ForceInput>,
    pub(in crate::dynamics) sites: Vec<Site<C>>,
    /// Numbers that are no doubles.
    pub(in crate::dynamics) numbers: Vec<C>,
    /// What its potential does, and what it applies beside.
    pub(in crate::dynamics) parts: [ForceTape; 2],
    /// The same law over its length, where it is that of a spring and asks for nothing else.
    pub(crate) span: Option<Box<SpanLaw<C>>>,
    /// See [`Tape::needs_confirmation`].
    pub(crate) needs_confirmation: bool,
    /// Potential energy \[J\].
    pub(super) potential: Option<(Tape, Slot)>,
}

impl UserForce {
    /// What it does at other places, and with other numbers in its formulas, one by one.
    pub(in crate::dynamics) fn map<D>(
        &self,
        mut of: impl FnMut(f64) -> D,
        point: impl Fn(&Point, &mut dyn FnMut(f64) -> D) -> Point<D>,
    ) -> UserForce<D> {
        let site = |site: &Site| Site { body: site.body, point: point(&site.point, &mut of) };
        let sites = self.sites.iter().map(site).collect();
        let (mut inputs, mut numbers) = (self.inputs.clone(), Vec::new());
        let mut input = |value: f64| {
            inputs.push(ForceInput::Number(numbers.len()));
            numbers.push(of(value));
            inputs.len() as u32 - 1
        };
        let parts = self.parts.each_ref().map(|part| {
            let (tape, new) = part.tape.lifted(&mut input);
            let at = |slot: Slot| new[slot as usize];
            ForceTape {
                tape,
                forces: part.forces.iter().map(|&(site, xy)| (site, xy.map(at))).collect(),
                torques: part.torques.iter().map(|&(body, torque)| (body, at(torque))).collect(),
                power: part.power.map(at),
            }
        });
        UserForce {
            name: self.name.clone(),
            inputs,
            sites,
            numbers,
            parts,
            // Neither is asked for by series.
            span: None,
            potential: None,
            needs_confirmation: self.needs_confirmation,
        }
    }
}

impl<C: Real> UserForce<C> {
    /// True where it does work that no energy stands for.
    pub fn does_work(&self) -> bool {
        self.parts[1].power.is_some()
    }

    /// True where whole turns matter to it.
    pub fn counts_turns(&self) -> bool {
        self.counted_angles().next().is_some()
    }

    /// The bodies whose whole turns matter to it.
    pub(crate) fn counted_angles(&self) -> impl Iterator<Item = usize> {
        let numbers = self.parts.iter().flat_map(|part| part.tape.inputs());
        numbers.filter_map(|number| match self.inputs[number as usize] {
            ForceInput::Angle(k) => Some(k),
            _ => None,
        })
    }

    /// True where time is in it.
    pub(crate) fn depends_on_time(&self) -> bool {
        let mut numbers = self.parts.iter().flat_map(|part| part.tape.inputs());
        numbers.any(|number| self.inputs[number as usize] == ForceInput::Time)
    }

    /// True where what is applied depends on rates, as drag does.
    pub fn depends_on_rates(&self) -> bool {
        let ForceTape { tape, forces, torques, .. } = &self.parts[1];
        let acting: Vec<Slot> =
            forces.iter().flat_map(|force| force.1).chain(torques.iter().map(|torque| torque.1)).collect();
        let mut needed = tape.inputs_of(&acting).into_iter();
        needed.any(|number| {
            matches!(
                self.inputs[number as usize],
                ForceInput::Rate(_) | ForceInput::XRate(_) | ForceInput::YRate(_)
            )
        })
    }

    /// Adds its tapes to a hash: inputs, operations, and on what their results act.
    pub(in crate::dynamics) fn hash_tapes(&self, hash: &mut Hash) {
        hash.count(self.inputs.len());
        for input in &self.inputs {
            let (kind, of) = match *input {
                ForceInput::Number(number) => (0, number),
                ForceInput::Time => (1, 0),
                ForceInput::Angle(body) => (2, body),
                ForceInput::Rate(body) => (3, body),
                ForceInput::Cosine(body) => (4, body),
                ForceInput::Sine(body) => (5, body),
                ForceInput::X(site) => (6, site),
                ForceInput::Y(site) => (7, site),
                ForceInput::XRate(site) => (8, site),
                ForceInput::YRate(site) => (9, site),
            };
            [kind, of].iter().for_each(|&count| hash.count(count));
        }
        for ForceTape { tape, forces, torques, power } in &self.parts {
            hash.tape(tape);
            hash.count(forces.len());
            for &(site, [x, y]) in forces {
                [site, x as usize, y as usize].iter().for_each(|&count| hash.count(count));
            }
            for &(body, torque) in torques {
                [body, torque as usize].iter().for_each(|&count| hash.count(count));
            }
            hash.count(power.map_or(0, |slot| slot as usize + 1));
        }
        if let Some((tape, value)) = &self.potential {
            hash.tape(tape);
            hash.count(*value as usize);
        }
    }

    /// True for a potential of positions and directions alone.
    pub fn is_potential_of_place(&self) -> bool {
        !self.does_work() && !self.counts_turns()
    }

    /// The largest number of a body it acts on or asks for.
    pub fn last_body(&self) -> Option<usize> {
        let asked = self.inputs.iter().filter_map(|input| match input {
            ForceInput::Angle(body)
            | ForceInput::Rate(body)
            | ForceInput::Cosine(body)
            | ForceInput::Sine(body) => Some(*body),
            _ => None,
        });
        let torques = self.parts[1].torques.iter().map(|torque| torque.0);
        asked.chain(self.sites.iter().filter_map(|site| site.body)).chain(torques).max()
    }

    /// Evaluates a tape at `time` \[s\] and calls `then` with all results.
    #[inline]
    fn at<T: Over<C>, R>(
        &self,
        tape: &Tape,
        time: T,
        at: ConstraintArguments<T>,
        then: impl FnOnce(&[T]) -> R,
    ) -> R {
        let input = |number: u32| match self.inputs[number as usize] {
            ForceInput::Number(number) => T::constant(self.numbers[number]),
            ForceInput::Time => time,
            ForceInput::Angle(body) => at.phi[body],
            ForceInput::Rate(body) => at.omega[body],
            ForceInput::Cosine(body) => at.z[body].re,
            ForceInput::Sine(body) => at.z[body].im,
            ForceInput::X(site) => self.sites[site].point.position(at.z).re,
            ForceInput::Y(site) => self.sites[site].point.position(at.z).im,
            ForceInput::XRate(site) => self.sites[site].point.velocity(at.z, at.omega).re,
            ForceInput::YRate(site) => self.sites[site].point.velocity(at.z, at.omega).im,
        };
        tape.results(input, then)
    }

    /// Calls `force` with every site and the force \[N\] there, and `torque` with every body and the torque
    /// \[N·m\] on it.
    #[inline]
    fn each<T: Over<C>>(
        &self,
        part: &ForceTape,
        time: T,
        at: ConstraintArguments<T>,
        mut force: impl FnMut(&Site<C>, Complex<T>),
        mut torque: impl FnMut(usize, T),
    ) {
        if part.tape.is_empty() {
            return;
        }
        self.at(&part.tape, time, at, |slots| {
            for &(site, [x, y]) in &part.forces {
                force(&self.sites[site], Complex::new(slots[x as usize], slots[y as usize]));
            }
            for &(body, slot) in &part.torques {
                torque(body, slots[slot as usize]);
            }
        });
    }

    /// Adds the generalized forces \[N·m, N\] of a part; returns its power accounted as work \[W\].
    fn pull_part<T: Over<C>>(
        &self,
        part: &ForceTape,
        time: T,
        at: ConstraintArguments<T>,
        load: &mut [T],
    ) -> T {
        if part.tape.is_empty() {
            return T::ZERO;
        }
        self.at(&part.tape, time, at, |slots| {
            for &(site, [x, y]) in &part.forces {
                let force = Complex::new(slots[x as usize], slots[y as usize]);
                self.sites[site].point.pull(force, at.z, load);
            }
            for &(body, slot) in &part.torques {
                load[body] += slots[slot as usize];
            }
            part.power.map_or(T::ZERO, |slot| slots[slot as usize])
        })
    }

    /// Adds all its generalized forces \[N·m, N\]; returns the power accounted as work \[W\].
    pub fn pull<T: Over<C>>(&self, time: T, at: ConstraintArguments<T>, load: &mut [T]) -> T {
        if let Some(span) = &self.span {
            return span.pull(time, at, load);
        }
        self.parts.iter().fold(T::ZERO, |power, part| power + self.pull_part(part, time, at, load))
    }

    /// Adds those of its potential.
    pub fn pull_by_potential<T: Over<C>>(&self, time: T, at: ConstraintArguments<T>, load: &mut [T]) {
        self.pull_part(&self.parts[0], time, at, load);
    }

    /// Adds those applied beside.
    pub fn pull_applied<T: Over<C>>(&self, time: T, at: ConstraintArguments<T>, load: &mut [T]) {
        self.pull_part(&self.parts[1], time, at, load);
    }

    /// Calls `force` with every element and the force \[N·m, N\] on it; torques act across their unit
    /// vectors.
    pub fn spread<T: Over<C>>(
        &self,
        time: T,
        at: ConstraintArguments<T>,
        force: impl FnMut(usize, Complex<T>),
    ) {
        let force = std::cell::RefCell::new(force);
        let torque = |body: usize, torque| (force.borrow_mut())(body, at.z[body].left().times(torque));
        for part in &self.parts {
            self.each(part, time, at, |site, pull| site.point.spread(pull, &mut *force.borrow_mut()), torque);
        }
    }

    /// Calls `force` with the body and the force \[N\] at every point it acts at.
    pub fn forces<T: Over<C>>(
        &self,
        time: T,
        at: ConstraintArguments<T>,
        mut force: impl FnMut(usize, Complex<T>),
    ) {
        for part in &self.parts {
            self.each(
                part,
                time,
                at,
                |site, pull| site.body.into_iter().for_each(|body| force(body, pull)),
                |_, _| {},
            );
        }
    }

    /// Magnitudes of forces \[N\] and torques \[N·m\] at a moment, summed.
    pub fn magnitudes(&self, time: f64, at: ConstraintArguments<f64>) -> [f64; 2]
    where
        f64: Over<C>,
    {
        let [mut force, mut torque] = [0.0; 2];
        for part in &self.parts {
            self.each(
                part,
                time,
                at,
                |_, pull| force += pull.norm_squared().sqrt(),
                |_, more| torque += more.abs(),
            );
        }
        [force, torque]
    }

    /// Potential energy \[J\].
    pub fn energy<T: Over<C>>(&self, time: T, at: ConstraintArguments<T>) -> T {
        let Some((tape, slot)) = &self.potential else { return T::ZERO };
        self.at(tape, time, at, |slots| slots[*slot as usize])
    }

    /// Power accounted as work \[W\].
    pub fn work_rate<T: Over<C>>(&self, time: T, at: ConstraintArguments<T>) -> T {
        let ForceTape { tape, power: Some(slot), .. } = &self.parts[1] else { return T::ZERO };
        self.at(tape, time, at, |slots| slots[*slot as usize])
    }
}
