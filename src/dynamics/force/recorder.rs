//! Forces recorded as tapes: run once on symbols, their potentials differentiated.

use super::user::{Force, ForceInput, ForceTape, Loads, UserForce};
use crate::arithmetic::tape::{Slot, Symbol, Tape, number_of};
use crate::arithmetic::{Complex, Real, Scalar};
use crate::dynamics::CompileError;
use crate::dynamics::configuration::{Configuration, ConfigurationSource};
use crate::dynamics::constraint::Site;
use std::cell::RefCell;

/// Hands out inputs while a force is recorded.
#[derive(Default)]
struct ForceRecorder<C> {
    inputs: RefCell<Vec<ForceInput>>,
    sites: RefCell<Vec<Site<C>>>,
    numbers: RefCell<Vec<C>>,
}

impl<C: Real> ForceRecorder<C> {
    fn input(&self, input: ForceInput) -> Symbol {
        Symbol::input(number_of(&self.inputs, &input) as u32)
    }

    fn site(&self, site: &Site<C>) -> usize {
        number_of(&self.sites, site)
    }
}

impl<C: Real> ConfigurationSource<Symbol, C> for ForceRecorder<C> {
    fn time(&self) -> Symbol {
        self.input(ForceInput::Time)
    }

    fn angle(&self, body: usize) -> Symbol {
        self.input(ForceInput::Angle(body))
    }

    fn rate(&self, body: usize) -> Symbol {
        self.input(ForceInput::Rate(body))
    }

    fn direction(&self, body: usize) -> Complex<Symbol> {
        Complex::new(self.input(ForceInput::Cosine(body)), self.input(ForceInput::Sine(body)))
    }

    fn position(&self, site: &Site<C>) -> Complex<Symbol> {
        if site.body.is_none() {
            let root = site.point.root;
            return Complex::new(self.constant(root.re), self.constant(root.im));
        }
        let site = self.site(site);
        Complex::new(self.input(ForceInput::X(site)), self.input(ForceInput::Y(site)))
    }

    fn velocity(&self, site: &Site<C>) -> Complex<Symbol> {
        if site.body.is_none() {
            return Complex::ZERO;
        }
        let site = self.site(site);
        Complex::new(self.input(ForceInput::XRate(site)), self.input(ForceInput::YRate(site)))
    }

    /// What is no double is an input: the tape folds constants in doubles.
    fn constant(&self, value: C) -> Symbol {
        if C::HAS_CONSTANTS {
            self.input(ForceInput::Number(number_of(&self.numbers, &value)))
        } else {
            Symbol::of(value.value())
        }
    }
}

/// What a force comes to, in symbols.
#[derive(Default)]
struct ForceSymbols {
    forces: Vec<(usize, [Symbol; 2])>,
    torques: Vec<(usize, Symbol)>,
}

impl ForceSymbols {
    /// Adds a share of a generalized force that belongs to an input.
    fn add<C: Real>(&mut self, recorder: &ForceRecorder<C>, input: ForceInput, share: Symbol) {
        let (place, vector) = match input {
            ForceInput::X(site) => (site, [share, Symbol::ZERO]),
            ForceInput::Y(site) => (site, [Symbol::ZERO, share]),
            ForceInput::Angle(body) => return self.torques.push((body, share)),
            ForceInput::Cosine(body) => {
                return self.torques.push((body, -(share * recorder.input(ForceInput::Sine(body)))));
            }
            ForceInput::Sine(body) => {
                return self.torques.push((body, share * recorder.input(ForceInput::Cosine(body))));
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
    fn part(&self, (tape, slots): (Tape, Vec<Slot>)) -> ForceTape {
        let (forces, rest) = slots.split_at(2 * self.forces.len());
        let (torques, power) = rest.split_at(self.torques.len());
        ForceTape {
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
        let recorder = ForceRecorder::default();
        let mut pulls = ForceSymbols::default();
        let [recorded] = Symbol::record(|| {
            for (number, slope) in potential(&Configuration::new(&recorder)).gradient() {
                let input = recorder.inputs.borrow()[number as usize];
                if matches!(input, ForceInput::X(_) | ForceInput::Y(_)) {
                    pulls.add(&recorder, input, -slope);
                }
            }
            [pulls.symbols()]
        });
        let of_forces = |part: ForceTape| Self {
            name: String::new(),
            needs_confirmation: part.tape.needs_confirmation(),
            parts: [part, ForceTape::default()],
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
        let recorder = ForceRecorder::default();
        let (mut conservative, mut applied) = (ForceSymbols::default(), ForceSymbols::default());
        let mut refused = None;
        let [by_potential, beside, energy] = Symbol::record(|| {
            let at = Configuration::new(&recorder);
            let potential = potential(&at);
            for (number, slope) in potential.gradient() {
                let input = recorder.inputs.borrow()[number as usize];
                match input {
                    ForceInput::Time | ForceInput::Rate(_) | ForceInput::XRate(_) | ForceInput::YRate(_) => {
                        refused = Some(CompileError::NoPotential(name.into()));
                    }
                    ForceInput::Number(_) => {}
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
                applied.add(&recorder, ForceInput::X(site), x);
                applied.add(&recorder, ForceInput::Y(site), y);
            }
            for (body, torque) in loads.torques {
                power += torque * recorder.rate(body);
                applied.add(&recorder, ForceInput::Angle(body), torque);
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
            needs_confirmation: parts.iter().any(|part| part.tape.needs_confirmation()),
            parts,
            span: None,
            potential: energy.1.first().map(|&slot| (energy.0, slot)),
            inputs: recorder.inputs.into_inner(),
            sites: recorder.sites.into_inner(),
            numbers: recorder.numbers.into_inner(),
        })
    }
}
