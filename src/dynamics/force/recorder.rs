//! Forces recorded as tapes: run once on symbols, their potentials differentiated.

use super::user::{Force, Input, Loads, Part, UserForce};
use crate::arithmetic::tape::{Slot, Symbol, Tape, number_of};
use crate::arithmetic::{Complex, Real, Scalar};
use crate::dynamics::CompileError;
use crate::dynamics::configuration::{Configuration, Source};
use crate::dynamics::constraint::Site;
use std::cell::RefCell;

/// Hands out inputs while a force is recorded.
#[derive(Default)]
struct Recorder<C> {
    inputs: RefCell<Vec<Input>>,
    sites: RefCell<Vec<Site<C>>>,
    numbers: RefCell<Vec<C>>,
}

impl<C: Real> Recorder<C> {
    fn input(&self, input: Input) -> Symbol {
        Symbol::input(number_of(&self.inputs, &input) as u32)
    }

    fn site(&self, site: &Site<C>) -> usize {
        number_of(&self.sites, site)
    }
}

impl<C: Real> Source<Symbol, C> for Recorder<C> {
    fn time(&self) -> Symbol {
        self.input(Input::Time)
    }

    fn angle(&self, body: usize) -> Symbol {
        self.input(Input::Angle(body))
    }

    fn rate(&self, body: usize) -> Symbol {
        self.input(Input::Rate(body))
    }

    fn direction(&self, body: usize) -> Complex<Symbol> {
        Complex::new(self.input(Input::Cosine(body)), self.input(Input::Sine(body)))
    }

    fn position(&self, site: &Site<C>) -> Complex<Symbol> {
        if site.body.is_none() {
            let root = site.point.root;
            return Complex::new(self.constant(root.re), self.constant(root.im));
        }
        let site = self.site(site);
        Complex::new(self.input(Input::X(site)), self.input(Input::Y(site)))
    }

    fn velocity(&self, site: &Site<C>) -> Complex<Symbol> {
        if site.body.is_none() {
            return Complex::ZERO;
        }
        let site = self.site(site);
        Complex::new(self.input(Input::XRate(site)), self.input(Input::YRate(site)))
    }

    /// What is no double is an input: the tape folds constants in doubles.
    fn constant(&self, value: C) -> Symbol {
        if C::HAS_CONSTANTS {
            self.input(Input::Number(number_of(&self.numbers, &value)))
        } else {
            Symbol::of(value.value())
        }
    }
}

/// What a force comes to, in symbols.
#[derive(Default)]
struct Recorded {
    forces: Vec<(usize, [Symbol; 2])>,
    torques: Vec<(usize, Symbol)>,
}

impl Recorded {
    /// Adds a share of a generalized force that belongs to an input.
    fn add<C: Real>(&mut self, recorder: &Recorder<C>, input: Input, share: Symbol) {
        let (place, vector) = match input {
            Input::X(site) => (site, [share, Symbol::ZERO]),
            Input::Y(site) => (site, [Symbol::ZERO, share]),
            Input::Angle(body) => return self.torques.push((body, share)),
            Input::Cosine(body) => {
                return self.torques.push((body, -(share * recorder.input(Input::Sine(body)))));
            }
            Input::Sine(body) => {
                return self.torques.push((body, share * recorder.input(Input::Cosine(body))));
            }
            _ => return,
        };
        match self.forces.iter_mut().find(|(site, _)| *site == place) {
            Some((_, force)) => force.iter_mut().zip(vector).for_each(|(force, more)| *force += more),
            None => self.forces.push((place, vector)),
        }
    }

    fn symbols(&self) -> Vec<Symbol> {
        self.forces
            .iter()
            .flat_map(|force| force.1)
            .chain(self.torques.iter().map(|torque| torque.1))
            .collect()
    }

    /// Of results and their tape: forces, torques, and the power if there is one more.
    fn part(&self, (tape, slots): (Tape, Vec<Slot>)) -> Part {
        let (forces, rest) = slots.split_at(2 * self.forces.len());
        let (torques, power) = rest.split_at(self.torques.len());
        Part {
            tape,
            forces: self
                .forces
                .iter()
                .zip(forces.chunks_exact(2))
                .map(|(force, slots)| (force.0, [slots[0], slots[1]]))
                .collect(),
            torques: self.torques.iter().zip(torques).map(|(torque, &slot)| (torque.0, slot)).collect(),
            power: power.first().copied(),
        }
    }
}

impl UserForce {
    /// Records a force.
    ///
    /// # Errors
    /// A potential that depends on time or rates.
    pub fn record(force: &impl Force) -> Result<Self, CompileError> {
        Self::recorded(force.name(), |at| force.potential(at), |at, loads| force.apply(at, loads))
    }
}

impl<C: Real> UserForce<C> {
    /// Records the forces at points of bodies alone of what has this potential, which may depend on time;
    /// `None` where it asks for no such point.
    pub(in crate::dynamics) fn at_points(
        potential: impl FnOnce(&Configuration<Symbol, C>) -> Symbol,
    ) -> Option<Self> {
        let recorder = Recorder::default();
        let mut pulls = Recorded::default();
        let [recorded] = Symbol::record(|| {
            for (number, slope) in potential(&Configuration::new(&recorder)).gradient() {
                let input = recorder.inputs.borrow()[number as usize];
                if matches!(input, Input::X(_) | Input::Y(_)) {
                    pulls.add(&recorder, input, -slope);
                }
            }
            [pulls.symbols()]
        });
        let of_forces = |part: Part| Self {
            name: String::new(),
            may_be_flat: part.tape.may_be_flat(),
            parts: [part, Part::default()],
            span: None,
            potential: None,
            inputs: recorder.inputs.into_inner(),
            sites: recorder.sites.into_inner(),
            numbers: recorder.numbers.into_inner(),
        };
        (!pulls.forces.is_empty()).then(|| of_forces(pulls.part(recorded)))
    }

    /// Records what has this potential, and applies this beside.
    ///
    /// # Errors
    /// A potential that depends on time or rates.
    pub(super) fn recorded(
        name: &str,
        potential: impl FnOnce(&Configuration<Symbol, C>) -> Symbol,
        apply: impl FnOnce(&Configuration<Symbol, C>, &mut Loads<Symbol, C>),
    ) -> Result<Self, CompileError> {
        let recorder = Recorder::default();
        let (mut conservative, mut applied) = (Recorded::default(), Recorded::default());
        let mut refused = None;
        let [by_potential, beside, energy] = Symbol::record(|| {
            let at = Configuration::new(&recorder);
            let potential = potential(&at);
            for (number, slope) in potential.gradient() {
                let input = recorder.inputs.borrow()[number as usize];
                match input {
                    Input::Time | Input::Rate(_) | Input::XRate(_) | Input::YRate(_) => {
                        refused = Some(CompileError::NoPotential(name.into()));
                    }
                    Input::Number(_) => {}
                    _ => conservative.add(&recorder, input, -slope),
                }
            }
            let mut loads = Loads::default();
            apply(&at, &mut loads);
            let mut power = Symbol::ZERO;
            for (site, [x, y]) in loads.forces {
                let velocity = recorder.velocity(&site);
                power += x * velocity.re + y * velocity.im;
                let site = recorder.site(&site);
                applied.add(&recorder, Input::X(site), x);
                applied.add(&recorder, Input::Y(site), y);
            }
            for (body, torque) in loads.torques {
                power += torque * recorder.rate(body);
                applied.add(&recorder, Input::Angle(body), torque);
            }
            let some = |symbol: Symbol| (!symbol.is_zero()).then_some(symbol);
            let beside = applied.symbols().into_iter().chain(some(power)).collect();
            [conservative.symbols(), beside, some(potential).into_iter().collect()]
        });
        if let Some(refused) = refused {
            return Err(refused);
        }
        let parts = [conservative.part(by_potential), applied.part(beside)];
        Ok(Self {
            name: name.into(),
            may_be_flat: parts.iter().any(|part| part.tape.may_be_flat()),
            parts,
            span: None,
            potential: energy.1.first().map(|&slot| (energy.0, slot)),
            inputs: recorder.inputs.into_inner(),
            sites: recorder.sites.into_inner(),
            numbers: recorder.numbers.into_inner(),
        })
    }
}
