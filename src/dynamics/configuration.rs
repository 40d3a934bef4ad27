//! Where a mechanism is at a moment, as user-defined forces and events see it.

use super::constraint::Site;
use super::point::Point;
use super::{CompileError, Mechanism, Motion};
use crate::arithmetic::scratch::with_copies;
use crate::arithmetic::{Complex, Over, Real, Scalar};
use std::cell::Cell;

/// What the ground is called.
const GROUND: &str = "ground";

/// Time, angles, rates and points of a mechanism at one moment, over any scalar: plain numbers where an event
/// function is evaluated, symbols where a [`Force`](super::force::Force) is recorded.
///
/// Bodies are named by their number in the order of the scene's bars ([`Mechanism::body`]), points by a
/// [`Site`] ([`Mechanism::site`]).
#[derive(Clone, Copy)]
pub struct Configuration<'a, S, C = f64>(&'a dyn ConfigurationSource<S, C>);

/// What a configuration is read from.
pub trait ConfigurationSource<S, C = f64> {
    /// Time \[s\].
    fn time(&self) -> S;
    /// Angle of a body \[rad\], winding.
    fn angle(&self, body: usize) -> S;
    /// Its rate \[rad/s\].
    fn rate(&self, body: usize) -> S;
    /// Its unit vector (cos, sin).
    fn direction(&self, body: usize) -> Complex<S>;
    /// Position of a point \[m\].
    fn position(&self, site: &Site<C>) -> Complex<S>;
    /// Its velocity \[m/s\].
    fn velocity(&self, site: &Site<C>) -> Complex<S>;
    /// A number of a formula.
    fn constant(&self, value: C) -> S;
}

impl<'a, S: Scalar, C> Configuration<'a, S, C> {
    /// That of a source.
    pub fn new(source: &'a dyn ConfigurationSource<S, C>) -> Self {
        Self(source)
    }

    /// Time \[s\].
    pub fn time(&self) -> S {
        self.0.time()
    }

    /// Absolute angle of a body from +x, counter-clockwise, with its whole turns \[rad\].
    ///
    /// A force that uses it makes the mechanism integrate winding angles; [`direction`](Self::direction) does
    /// not.
    pub fn angle(&self, body: usize) -> S {
        self.0.angle(body)
    }

    /// Rate of that angle \[rad/s\].
    pub fn rate(&self, body: usize) -> S {
        self.0.rate(body)
    }

    /// Cosine and sine of that angle.
    pub fn direction(&self, body: usize) -> [S; 2] {
        pair(self.0.direction(body))
    }

    /// Position of a point of a body or of the ground \[m\].
    pub fn position(&self, site: &Site<C>) -> [S; 2] {
        pair(self.0.position(site))
    }

    /// Velocity of that point \[m/s\].
    pub fn velocity(&self, site: &Site<C>) -> [S; 2] {
        pair(self.0.velocity(site))
    }

    /// A number of a formula.
    pub(in crate::dynamics) fn constant(&self, value: C) -> S {
        self.0.constant(value)
    }
}

fn pair<S>(z: Complex<S>) -> [S; 2] {
    [z.re, z.im]
}

/// A configuration given by numbers.
pub struct Values<'a, S> {
    /// Time \[s\].
    pub time: S,
    /// Winding angles of the bodies \[rad\].
    pub phi: &'a [S],
    /// Elements: unit vectors of the bodies, then translational coordinates.
    pub z: &'a [Complex<S>],
    /// Rates of all coordinates \[rad/s, m/s\].
    pub omega: &'a [S],
}

impl<S: Scalar + Over<C>, C: Real> ConfigurationSource<S, C> for Values<'_, S> {
    fn time(&self) -> S {
        self.time
    }

    fn angle(&self, body: usize) -> S {
        self.phi[body]
    }

    fn rate(&self, body: usize) -> S {
        self.omega[body]
    }

    fn direction(&self, body: usize) -> Complex<S> {
        self.z[body]
    }

    fn position(&self, site: &Site<C>) -> Complex<S> {
        site.point.position(self.z)
    }

    fn velocity(&self, site: &Site<C>) -> Complex<S> {
        site.point.velocity(self.z, self.omega)
    }

    fn constant(&self, value: C) -> S {
        S::constant(value)
    }
}

/// What a vector of a body that is not there is.
const NOWHERE: Complex<f64> = Complex { re: f64::NAN, im: f64::NAN };

/// A configuration that notes where a body is asked for that is not there, and has no number of it.
struct Checked<'a> {
    at: &'a Configuration<'a, f64>,
    bodies: usize,
    coordinates: usize,
    is_foreign: Cell<bool>,
}

impl Checked<'_> {
    /// What is found where the body is there; else the other.
    fn of<R>(&self, is_there: bool, find: impl FnOnce(&dyn ConfigurationSource<f64>) -> R, other: R) -> R {
        self.is_foreign.set(self.is_foreign.get() || !is_there);
        if is_there { find(self.at.0) } else { other }
    }

    fn has(&self, site: &Site) -> bool {
        let Point { terms, shifts, .. } = &site.point;
        terms.iter().all(|term| term.0 < self.bodies)
            && shifts.iter().all(|shift| shift.0 + 1 < self.coordinates)
    }
}

impl ConfigurationSource<f64> for Checked<'_> {
    fn time(&self) -> f64 {
        self.at.time()
    }

    fn angle(&self, body: usize) -> f64 {
        self.of(body < self.bodies, |at| at.angle(body), f64::NAN)
    }

    fn rate(&self, body: usize) -> f64 {
        self.of(body < self.bodies, |at| at.rate(body), f64::NAN)
    }

    fn direction(&self, body: usize) -> Complex<f64> {
        self.of(body < self.bodies, |at| at.direction(body), NOWHERE)
    }

    fn position(&self, site: &Site) -> Complex<f64> {
        self.of(self.has(site), |at| at.position(site), NOWHERE)
    }

    fn velocity(&self, site: &Site) -> Complex<f64> {
        self.of(self.has(site), |at| at.velocity(site), NOWHERE)
    }

    fn constant(&self, value: f64) -> f64 {
        value
    }
}

impl Mechanism {
    /// Calls `then`, which is from outside, with a configuration that has no number of bodies that are not
    /// there; true where it asks for such a body.
    pub(crate) fn checked<R>(
        &self,
        at: &Configuration<f64>,
        then: impl FnOnce(&Configuration<f64>) -> R,
    ) -> (R, bool) {
        let (bodies, coordinates) = (self.own_bodies().len(), self.coordinates());
        let checked = Checked { at, bodies, coordinates, is_foreign: Cell::new(false) };
        let found = then(&Configuration::new(&checked));
        (found, checked.is_foreign.get())
    }

    /// Calls `then` with the configuration of a motion.
    pub(crate) fn seen<R>(&self, motion: &Motion, then: impl FnOnce(&Configuration<f64>) -> R) -> R {
        let n = motion.phi.len();
        with_copies(Complex::ZERO, n, |z| {
            with_copies(0.0, 2 * n, |values| {
                let (phi, omega) = values.split_at_mut(n);
                phi.iter_mut().zip(&motion.phi).for_each(|(to, phi)| *to = phi.hi);
                omega.iter_mut().zip(&motion.omega).for_each(|(to, omega)| *to = omega.hi);
                self.tree.unit_vectors::<f64, 0>(phi, z);
                (0..n).for_each(|k| phi[k] = motion.unwrapped(k));
                then(&Configuration::new(&Values { time: motion.time.hi, phi, z, omega }))
            })
        })
    }

    /// Number of the bar of this name.
    ///
    /// # Errors
    /// No bar has this name.
    pub fn body(&self, name: &str) -> Result<usize, CompileError> {
        self.own_bodies()
            .iter()
            .position(|body| body.name == name)
            .ok_or_else(|| CompileError::NoSuchBar(name.into()))
    }

    /// The point `[x, y]` \[m\] of the bar of this name, in the bar's frame: from its origin, x along it; of
    /// `ground`, the point of the ground there, as [`Site::ground`].
    ///
    /// # Errors
    /// No bar has this name.
    pub fn site(&self, bar: &str, [x, y]: [f64; 2]) -> Result<Site, CompileError> {
        if bar == GROUND {
            return Ok(Site::ground([x, y]));
        }
        let body = self.body(bar)?;
        let point = self.forest.walk(body, Complex::new(x, y) + self.bodies[body].ends[0]);
        Ok(Site { body: Some(body), point })
    }
}
