//! The two bars' equations written by hand, for the bare crates.

use differential_equations::prelude::{ExplicitRungeKutta, IVP, ODE};
use driftless::dynamics::{Mechanism, Motion, Time};
use nalgebra::SVector;
use ode_solvers::dop_shared::{OutputType, System};

/// Constants of two bars on their axes with gravity along +x.
#[derive(Clone, Copy)]
pub struct TwoBars {
    inner: f64,
    coupling: f64,
    outer: f64,
    weight: [f64; 2],
}

impl TwoBars {
    pub fn of(mechanism: &Mechanism) -> Self {
        let tree = &mechanism.tree;
        let weight = [tree.weight[0].re, tree.weight[1].re];
        Self { inner: tree.diagonal[0], coupling: tree.coupling[1].re, outer: tree.diagonal[1], weight }
    }

    #[inline(always)]
    fn rate(&self, y: [f64; 4]) -> [f64; 4] {
        let [phi1, phi2, w1, w2] = y;
        let ((s1, c1), (s2, c2)) = (phi1.sin_cos(), phi2.sin_cos());
        let (cos, sin) = (c1 * c2 + s1 * s2, s1 * c2 - c1 * s2);
        let m12 = self.coupling * cos;
        let b1 = -self.coupling * sin * w2 * w2 - self.weight[0] * s1;
        let b2 = self.coupling * sin * w1 * w1 - self.weight[1] * s2;
        let det = self.inner * self.outer - m12 * m12;
        [w1, w2, (self.outer * b1 - m12 * b2) / det, (self.inner * b2 - m12 * b1) / det]
    }

    /// The crate `ode_solvers` itself, by its Dop853.
    pub fn ode_solvers(&self, start: &Motion, until: f64, tolerance: f64) -> Motion {
        let y = SVector::from(unknowns(start));
        let (safety, beta, smallest, largest) = (0.9, 0.0, 1.0 / 3.0, 6.0);
        let mut stepper = ode_solvers::Dop853::from_param(
            *self,
            0.0,
            until,
            until,
            y,
            tolerance,
            tolerance,
            safety,
            beta,
            smallest,
            largest,
            until,
            0.0,
            10_000_000,
            u32::MAX,
            OutputType::Sparse,
        );
        stepper.integrate().expect("an end");
        motion(stepper.y_out().last().copied().unwrap_or(y).into())
    }

    /// The crate `differential-equations` by its Verner 9(8) pair.
    pub fn verner(&self, start: &Motion, until: f64, tolerance: f64) -> Motion {
        let method = ExplicitRungeKutta::rkv988e().rtol(tolerance).atol(tolerance).max_steps(10_000_000);
        let solution = IVP::ode(self, 0.0, until, unknowns(start))
            .t_eval([until])
            .method(method)
            .solve()
            .expect("an end");
        motion(solution.y.last().copied().unwrap_or_default())
    }
}

fn unknowns(start: &Motion) -> [f64; 4] {
    [start.phi[0].hi, start.phi[1].hi, start.omega[0].hi, start.omega[1].hi]
}

fn motion(y: [f64; 4]) -> Motion {
    let mut motion = Motion::default();
    motion.resize(2);
    for k in 0..2 {
        (motion.phi[k], motion.omega[k]) = (Time::from(y[k]).reduced().0, Time::from(y[2 + k]));
    }
    motion
}

impl System<f64, SVector<f64, 4>> for TwoBars {
    fn system(&self, _: f64, y: &SVector<f64, 4>, rate: &mut SVector<f64, 4>) {
        *rate = SVector::from(TwoBars::rate(self, [y[0], y[1], y[2], y[3]]));
    }
}

impl ODE<f64, [f64; 4]> for TwoBars {
    fn diff(&self, _: f64, y: &[f64; 4], rate: &mut [f64; 4]) {
        *rate = TwoBars::rate(self, *y);
    }
}
