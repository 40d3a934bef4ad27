//! The hinges as a forest: which body hangs on which, which hinges close loops, which bodies hang on nothing.
//!
//! Breadth first from the ground, then from the first body of every group that is left: the depth is the
//! least there is, and with it the number of couplings.  Nobody chooses the tree; a hinge between bodies that
//! are connected already becomes a pin, and so does one that an event of the scene closes or releases.

use super::compile::Body;
use super::constraint::Site;
use super::point::Point;
use crate::arithmetic::{Complex, Over, Real, Scalar};
use crate::scene::{Place, Scene};

/// Where the origin of a body is: the point it hangs on, from which its points are counted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BodyOrigin<C = f64> {
    /// A point of the ground \[m\].
    Ground(Complex<C>),
    /// A point of another body, counted from that body's origin \[m\].
    On(usize, Complex<C>),
    /// A point that moves freely, with coordinates x and the one after it.
    Free(usize),
}

impl<C> BodyOrigin<C> {
    /// The body it is on.
    pub fn parent(&self) -> Option<usize> {
        if let Self::On(parent, _) = self { Some(*parent) } else { None }
    }
}

/// How a body hangs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hang<C = f64> {
    /// Its origin.
    pub origin_point: BodyOrigin<C>,
    /// The origin in the body's own frame \[m\].
    pub own: Complex<C>,
}

/// The forest of a scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Forest<C = f64> {
    /// How each body hangs.
    pub hangs: Vec<Hang<C>>,
    /// The bodies, each after the one it hangs on.
    pub order: Vec<usize>,
    /// The body that hangs on each hinge, then on each weld; `None` where it closes a loop.
    pub outer: Vec<Option<usize>>,
    /// Number of coordinates: angles, and two for each origin that moves freely.
    pub coordinates: usize,
}

impl<C: Real> Forest<C> {
    /// The forest of a scene's hinges and welds.
    pub fn new(scene: &Scene<C>) -> Self {
        let n = scene.bars.len();
        let joints: Vec<&[Place<C>; 2]> = scene
            .hinges
            .iter()
            .map(|hinge| &hinge.between)
            .chain(scene.welds.iter().map(|weld| &weld.between))
            .collect();
        let slot = |bar: Option<usize>| bar.map_or(0, |bar| bar + 1);
        let mut at: Vec<Vec<usize>> = vec![Vec::new(); n + 1];
        // What an event closes or releases is kept by rows, which begin or end with it.
        let is_switched =
            |joint: usize| scene.hinges.get(joint).is_some_and(|hinge| scene.is_switched(&hinge.name));
        for (joint, between) in joints.iter().enumerate().filter(|(joint, _)| !is_switched(*joint)) {
            for place in *between {
                at[slot(place.bar)].push(joint);
            }
        }
        let mut hangs: Vec<Option<Hang<C>>> = vec![None; n];
        let mut outer = vec![None; joints.len()];
        let (mut order, mut coordinates) = (Vec::with_capacity(n), n);
        for root in std::iter::once(None).chain((0..n).map(Some)) {
            if let Some(body) = root {
                if hangs[body].is_some() {
                    continue;
                }
                hangs[body] = Some(Hang { origin_point: BodyOrigin::Free(coordinates), own: Complex::ZERO });
                coordinates += 2;
                order.push(body);
            }
            let mut front = std::collections::VecDeque::from([root]);
            while let Some(inner) = front.pop_front() {
                for &joint in &at[slot(inner)] {
                    let [a, b] = joints[joint];
                    let (near, far) = if a.bar == inner { (a, b) } else { (b, a) };
                    let Some(body) = far.bar.filter(|&body| hangs[body].is_none()) else { continue };
                    let near = Complex::new(near.point[0], near.point[1]);
                    let origin_point = match inner.and_then(|parent| Some((parent, hangs[parent]?))) {
                        Some((parent, hang)) => BodyOrigin::On(parent, near - hang.own),
                        None => BodyOrigin::Ground(near),
                    };
                    hangs[body] = Some(Hang { origin_point, own: Complex::new(far.point[0], far.point[1]) });
                    outer[joint] = Some(body);
                    order.push(body);
                    front.push_back(Some(body));
                }
            }
        }
        Self { hangs: hangs.into_iter().flatten().collect(), order, outer, coordinates }
    }

    /// A place of the scene as a point, by walking up the tree.
    pub fn point(&self, place: &Place<C>) -> Point<C> {
        match place.bar {
            None => Point::ground(place.point),
            Some(bar) => self.walk(bar, Complex::new(place.point[0], place.point[1]) - self.hangs[bar].own),
        }
    }

    /// A point of a body, `offset` from its origin in its frame \[m\].
    pub fn walk(&self, body: usize, offset: Complex<C>) -> Point<C> {
        let mut path = vec![(body, offset)];
        let mut origin_point = self.hangs[body].origin_point;
        while let BodyOrigin::On(parent, offset) = origin_point {
            path.push((parent, offset));
            origin_point = self.hangs[parent].origin_point;
        }
        let mut point = match origin_point {
            BodyOrigin::Free(x) => Point::floating(x),
            BodyOrigin::Ground(at) => Point { root: at, ..Point::default() },
            BodyOrigin::On(..) => Point::default(),
        };
        path.sort_unstable_by_key(|term| term.0);
        path.retain(|term| term.1 != Complex::ZERO);
        point.terms = path;
        point
    }

    /// A place with the body it is on.
    pub fn site(&self, place: &Place<C>) -> Site<C> {
        Site { body: place.bar, point: self.point(place) }
    }

    /// The ground point that each body hangs from, one body on another; the origin where an origin moves
    /// freely \[m\].
    pub fn roots(&self) -> Vec<Complex<C>> {
        let mut roots = vec![Complex::ZERO; self.hangs.len()];
        for &body in &self.order {
            roots[body] = match self.hangs[body].origin_point {
                BodyOrigin::Ground(at) => at,
                BodyOrigin::On(parent, _) => roots[parent],
                BodyOrigin::Free(_) => Complex::ZERO,
            };
        }
        roots
    }

    /// Writes the translational coordinates of all bodies at the elements `z`, outwards \[m\].
    #[inline(always)]
    pub fn translations<T: Over<C>>(&self, z: &[Complex<T>], translations: &mut [Complex<T>]) {
        for &body in &self.order {
            translations[body] = match self.hangs[body].origin_point {
                BodyOrigin::Ground(at) => Complex::of(at),
                BodyOrigin::On(parent, offset) => translations[parent] + z[parent].turn(offset),
                BodyOrigin::Free(x) => z[x],
            };
        }
    }

    /// Writes the velocities of the translational coordinates \[m/s\].
    #[inline(always)]
    pub fn origin_velocities<T: Over<C>>(
        &self,
        z: &[Complex<T>],
        omega: &[T],
        translations: &mut [Complex<T>],
    ) {
        for &body in &self.order {
            translations[body] = match self.hangs[body].origin_point {
                BodyOrigin::Ground(_) => Complex::ZERO,
                BodyOrigin::On(parent, offset) => {
                    translations[parent] + z[parent].turn(offset).left().times(omega[parent])
                }
                BodyOrigin::Free(x) => Complex::new(omega[x], omega[x + 1]),
            };
        }
    }

    /// Calls `see` with every body's number, its centre of mass \[m\] and the velocity of that \[m/s\] at
    /// these elements and rates; the translational coordinates and their velocities go into `origins`.
    #[inline(always)]
    pub fn each_centre<T: Over<C>>(
        &self,
        bodies: &[Body<C>],
        (z, omega): (&[Complex<T>], &[T]),
        [translations, velocities]: &mut [Vec<Complex<T>>; 2],
        mut see: impl FnMut(usize, Complex<T>, Complex<T>),
    ) {
        self.translations(z, translations);
        self.origin_velocities(z, omega, velocities);
        for (k, body) in bodies.iter().enumerate() {
            let arm = z[k].turn(body.centre);
            see(k, translations[k] + arm, velocities[k] + arm.left().times(omega[k]));
        }
    }

    /// Writes the accelerations of the translational coordinates \[m/s²\].
    pub fn origin_accelerations<T: Over<C>>(
        &self,
        z: &[Complex<T>],
        omega: &[T],
        alpha: &[T],
        translations: &mut [Complex<T>],
    ) {
        for &body in &self.order {
            translations[body] = match self.hangs[body].origin_point {
                BodyOrigin::Ground(_) => Complex::ZERO,
                BodyOrigin::On(parent, offset) => {
                    translations[parent]
                        + turning_acceleration(z[parent].turn(offset), omega[parent], alpha[parent])
                }
                BodyOrigin::Free(x) => Complex::new(alpha[x], alpha[x + 1]),
            };
        }
    }
}

/// Acceleration \[m/s²\] of the end of an arm that turns.
pub fn turning_acceleration<T: Scalar>(arm: Complex<T>, omega: T, alpha: T) -> Complex<T> {
    arm.left().times(alpha) - arm.times(omega * omega)
}
