//! The hinge trees body by body: accelerations in a number of operations proportional to the number of
//! bodies.
//!
//! What hangs on a hinge answers an acceleration `a` of the hinge with the force `R = A a + b` on it: a
//! symmetric apparent mass A (2 × 2) and a force b, whatever the joints beyond are free to do.  Both are
//! found from the outermost bodies inwards; then the accelerations follow outwards.
//!
//! ```text
//! u_k = i z_p r_k
//!     lever of hinge k about the hinge of its parent p: O_k' = O_p' + u_k w_p
//! n_k = n_p + i u_k w_p²,  n_ground = -g    hinge acceleration where no coordinate accelerates, less gravity
//! h_k = i m z_k c_k,   f_k = m n_k + i h_k w_k²,   t_k = Q_k - h_k·n_k
//!     of the body alone, with the generalized force Q on its angle
//!
//! inwards:   B = m + Σ A_j,   h = h_k + Σ A_j u_j,   d = I + m |c|² + Σ u_j·A_j u_j,   f = f_k + Σ b_j,
//!     e = t_k - Σ u_j·b_j
//!            A_k = B - h hᵀ/d,   b_k = f + h e/d
//! outwards:  alpha_k = (e - h·a_k)/d,   a_j = a_k + u_j alpha_k,   a_ground = 0
//! ```
//!
//! Sums run over the bodies j that hang on k; r is the hinge on the parent and c the centre of mass, both
//! from the body's own hinge in the body's directions; x·y is the dot product of the plane, and `i x · y` the
//! moment of y with the arm x.  Hinge k accelerates with n_k + g + a_k. An origin that moves freely takes up
//! no force: `A a = Q - b` there, solved as two more coordinates.
//!
//! Eliminated this way M is L D Lᵀ with D the diagonal of the d and L the inward pass: the e are L⁻¹ of the
//! load, and for two loads P and Q `Pᵀ M⁻¹ Q = Σ e_P e_Q / d`, of which [`rows`] makes use.
//!
//! Source: R. Featherstone, *Rigid Body Dynamics Algorithms* (2008), section 7.3, the articulated-body
//! algorithm; that its passes are triangular factors: G. Rodriguez, *Kalman filtering, smoothing, and
//! recursive robot arm forward and inverse dynamics*, IEEE J. Robotics Autom. 3 (1987). Ours: in the plane,
//! with absolute angles and forces taken at the hinges, a hinge passes on no moment, so that two numbers by
//! two suffice; and the products with u are formed before the division by d is done, which is what the
//! recursion waits for.

pub mod evaluation;
pub mod load;
pub mod rows;

pub use evaluation::{Evaluation, Recursion};

use super::compile::Body;
use super::forest::{BodyOrigin, Forest};
use crate::arithmetic::{Complex, DoubleDouble, Real, Scalar};

/// A body in the order of the trees: every branch in one piece, inner bodies first, the ground before all.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Link {
    /// Its number in the scene.
    body: usize,
    /// Place of the parent; 0: the ground, or an origin that moves freely.
    parent: usize,
    /// Coordinate x of its origin where that moves freely; else 0, which is an angle.
    origin_point: usize,
    /// r \[m\].
    hinge: Complex<f64>,
    /// i m c \[kg·m\].
    moment: Complex<f64>,
    /// m \[kg\].
    mass: f64,
    /// I + m |c|² \[kg·m²\].
    inertia: f64,
    /// More than one body hangs on it.
    forks: bool,
    /// It is the only one that hangs on its parent, and follows it.
    alone: bool,
}

/// The constants of hinge trees of n bodies: n numbers of a kind.
#[derive(Clone, Debug, PartialEq)]
pub struct Links {
    /// The ground, then the bodies.
    links: Vec<Link>,
    /// Place of each body.
    place: Vec<usize>,
    /// Number of coordinates: the bodies' angles, then two for every origin that moves freely.
    coordinates: usize,
    /// Gravity \[m/s²\].
    gravity: Complex<f64>,
    /// Σ m gamma of each body, over all that it carries, itself included \[kg·m\].
    ///
    /// In double-double: M knows nothing of them, and what sums rounded otherwise leave is no mechanism's
    /// motion.
    carried: Vec<Complex<DoubleDouble>>,
}

impl Links {
    /// Puts bodies in the order of the trees.
    pub fn new(bodies: &[Body], forest: &Forest, gravity: Complex<f64>) -> Self {
        let n = bodies.len();
        let slot_of = |body: usize| forest.hangs[body].origin_point.parent().map_or(0, |parent| parent + 1);
        // What hangs on each slot, from the last body to the first; slot 0 is the ground.
        let (mut last, mut before) = (vec![0; n + 1], vec![0; n + 1]);
        for k in 0..n {
            let parent = slot_of(k);
            (before[k + 1], last[parent]) = (last[parent], k + 1);
        }
        let carries_one = |slot: usize| last[slot] != 0 && before[last[slot]] == 0;
        let origin = Complex::ZERO;
        let ground = Link {
            body: 0,
            parent: 0,
            origin_point: 0,
            hinge: origin,
            moment: origin,
            mass: 0.0,
            inertia: 1.0,
            forks: true,
            alone: false,
        };
        let (mut links, mut place) = (Vec::with_capacity(n + 1), vec![0; n]);
        let mut front = vec![0usize];
        while let Some(slot) = front.pop() {
            let mut link = ground;
            if let Some(k) = slot.checked_sub(1) {
                let (body, parent) = (&bodies[k], slot_of(k));
                place[k] = links.len();
                link = Link {
                    body: k,
                    moment: body.centre.left().times(body.mass),
                    mass: body.mass,
                    inertia: body.inertia + body.mass * body.centre.norm_squared(),
                    forks: last[slot] != 0 && !carries_one(slot),
                    alone: parent != 0 && carries_one(parent),
                    ..ground
                };
                match forest.hangs[k].origin_point {
                    BodyOrigin::Ground(_) => {}
                    BodyOrigin::On(parent, hinge) => (link.parent, link.hinge) = (place[parent], hinge),
                    BodyOrigin::Free(x) => link.origin_point = x,
                }
            }
            links.push(link);
            let mut child = last[slot];
            while child != 0 {
                front.push(child);
                child = before[child];
            }
        }
        let carried = carried(&links);
        Self { links, place, coordinates: forest.coordinates, gravity, carried }
    }

    /// Number of bodies.
    pub fn bodies(&self) -> usize {
        self.place.len()
    }

    /// Number of coordinates.
    pub fn coordinates(&self) -> usize {
        self.coordinates
    }
}

/// Σ m gamma of each body: of its own mass and of what hangs on it, at their hinges.
fn carried(links: &[Link]) -> Vec<Complex<DoubleDouble>> {
    let mut mass: Vec<DoubleDouble> = links.iter().map(|link| DoubleDouble::of(link.mass)).collect();
    let mut carried: Vec<Complex<DoubleDouble>> =
        links.iter().map(|link| Complex::of(-link.moment.left())).collect();
    for k in (1..links.len()).rev() {
        let parent = links[k].parent;
        let (beyond, hinge) = (mass[k], Complex::of(links[k].hinge));
        carried[parent] += hinge.times(beyond);
        mass[parent] += beyond;
    }
    carried
}

/// A body at one moment: what its motion alone asks for.
#[derive(Clone, Copy, Debug, Default)]
struct BodyTerms<T> {
    /// z.
    z: Complex<T>,
    /// u \[m\].
    lever: Complex<T>,
    /// w² \[rad²/s²\].
    square: T,
    /// n \[m/s²\].
    drift: Complex<T>,
    /// h of the body alone \[kg·m\].
    moment: Complex<T>,
    /// f of the body alone \[N\].
    force: Complex<T>,
    /// t of the body alone \[N·m\].
    torque: T,
}

/// A coordinate after the inward pass.
#[derive(Clone, Copy, Debug, Default)]
struct JointResponse<T> {
    /// h \[kg·m\]; of the x of an origin what its y takes along, as a number without unit in `re`.
    moment: Complex<T>,
    /// 1/d \[1/(kg·m²); 1/kg for an origin\].
    pivot: T,
    /// e \[N·m; N for an origin\].
    excess: T,
}

/// A symmetric matrix (2 × 2).
#[derive(Clone, Copy, Debug, Default)]
struct Symmetric<T> {
    xx: T,
    xy: T,
    yy: T,
}

impl<T: Scalar> Symmetric<T> {
    #[inline(always)]
    fn times(self, v: Complex<T>) -> Complex<T> {
        Complex { re: self.xx * v.re + self.xy * v.im, im: self.xy * v.re + self.yy * v.im }
    }

    /// Its two pivots, and the ratio between them: an origin.
    fn factors(self) -> [JointResponse<T>; 2] {
        let pivot = T::ONE / self.xx;
        let ratio = self.xy * pivot;
        let x = JointResponse { moment: Complex::new(ratio, T::ZERO), pivot, excess: T::ZERO };
        [
            x,
            JointResponse {
                moment: Complex::ZERO,
                pivot: T::ONE / (self.yy - self.xy * ratio),
                excess: T::ZERO,
            },
        ]
    }
}

/// What hangs on a body, as the body feels it.
#[derive(Clone, Copy, Debug, Default)]
struct Outer<T> {
    /// Σ A_j \[kg\].
    mass: Symmetric<T>,
    /// Σ A_j u_j \[kg·m\].
    moment: Complex<T>,
    /// Σ u_j·A_j u_j \[kg·m²\].
    inertia: T,
    /// Σ b_j \[N\].
    force: Complex<T>,
    /// Σ u_j·b_j \[N·m\].
    torque: T,
}

impl<T: Scalar> Outer<T> {
    #[inline(always)]
    fn join(&mut self, other: Self) {
        self.mass.xx += other.mass.xx;
        self.mass.xy += other.mass.xy;
        self.mass.yy += other.mass.yy;
        self.moment += other.moment;
        self.inertia += other.inertia;
        self.force += other.force;
        self.torque += other.torque;
    }
}

/// Scratch space of an evaluation; nothing is allocated after [`Recursive::new`].
///
/// An evaluation is [`convect`](Self::convect), where there are forces [`burden`](Self::burden),
/// [`fold`](Self::inward_pass), where there are rows what [`rows`] does, and
/// [`outward_pass`](Self::outward_pass).
#[derive(Clone, Debug)]
pub struct Recursive<T> {
    /// The ground, then the bodies.
    places: Vec<BodyTerms<T>>,
    /// Of each coordinate.
    joints: Vec<JointResponse<T>>,
    /// Sums over the bodies that hang on a fork; zero between evaluations.
    forks: Vec<Outer<T>>,
    /// a \[m/s²\], the ground's and the bodies'.
    hinge: Vec<Complex<T>>,
}

impl<T: Real> Recursive<T> {
    /// Scratch space for these bodies.
    pub fn new(links: &Links) -> Self {
        let (bodies, n) = (links.bodies(), links.coordinates);
        Self {
            places: vec![BodyTerms::default(); bodies + 1],
            joints: vec![JointResponse::default(); n],
            forks: vec![Outer::default(); bodies + 1],
            hinge: vec![Complex::ZERO; bodies + 1],
        }
    }

    /// The first outward pass, at the elements `z`: levers, velocity terms, gravity; no other forces.
    #[inline]
    pub fn convect(&mut self, links: &Links, elements: &[Complex<T>], omega: &[T]) {
        let all = &links.links[..];
        let places = &mut self.places[..all.len()];
        let (mut z, mut square) = (Complex::new(T::ONE, T::ZERO), T::ZERO);
        let mut drift = -Complex::of(links.gravity);
        places[0] = BodyTerms { z, square, drift, ..BodyTerms::default() };
        for k in 1..all.len() {
            let link = &all[k];
            if link.parent + 1 != k {
                BodyTerms { z, square, drift, .. } = places[link.parent];
            }
            let lever = z.turn(link.hinge).left();
            drift += lever.left().times(square);
            let w = omega[link.body];
            (z, square) = (elements[link.body], w * w);
            let moment = z.turn(link.moment);
            let force = drift.times(T::of(link.mass)) + moment.left().times(square);
            places[k] = BodyTerms { z, square, lever, drift, moment, force, torque: -moment.dot(drift) };
        }
    }

    /// Generalized forces \[N·m, N\] on all coordinates, after [`convect`](Self::convect).
    #[inline]
    pub fn burden(&mut self, links: &Links, load: &[T]) {
        for (place, link) in self.places.iter_mut().zip(&links.links).skip(1) {
            place.torque += load[link.body];
            if link.origin_point != 0 {
                place.force -= Complex::new(load[link.origin_point], load[link.origin_point + 1]);
            }
        }
    }

    /// The inward pass: the factors of M, and what is left of the load.
    #[inline]
    pub fn inward_pass(&mut self, links: &Links) {
        let all = &links.links[..];
        let n = all.len();
        let (places, joints, forks) = (&self.places[..n], &mut self.joints, &mut self.forks[..n]);
        forks[0] = Outer::default();
        let mut outer = Outer::default();
        for k in (1..n).rev() {
            let (link, here) = (&all[k], &places[k]);
            if link.forks {
                outer = std::mem::take(&mut forks[k]);
            }
            let (m, u) = (T::of(link.mass), here.lever);
            let mass = Symmetric { xx: outer.mass.xx + m, xy: outer.mass.xy, yy: outer.mass.yy + m };
            let moment = outer.moment + here.moment;
            let pivot = T::ONE / (outer.inertia + T::of(link.inertia));
            let force = outer.force + here.force;
            let excess = here.torque - outer.torque;
            // With the lever, as if the hinge did not give way; then what it takes off.
            let rigid = mass.times(u);
            let (inertia, across, torque) = (u.dot(rigid), moment.dot(u), u.dot(force));
            let share = moment.times(pivot);
            joints[link.body] = JointResponse { moment, pivot, excess };
            let felt = Outer {
                mass: Symmetric {
                    xx: mass.xx - share.re * moment.re,
                    xy: mass.xy - share.re * moment.im,
                    yy: mass.yy - share.im * moment.im,
                },
                moment: rigid - share.times(across),
                inertia: inertia - across * across * pivot,
                force: force + share.times(excess),
                torque: torque + across * pivot * excess,
            };
            if link.alone {
                outer = felt;
                continue;
            }
            forks[link.parent].join(felt);
            outer = Outer::default();
            if link.origin_point != 0 {
                let ([x, y], excess) = (felt.mass.factors(), -felt.force);
                joints[link.origin_point] = JointResponse { excess: excess.re, ..x };
                joints[link.origin_point + 1] =
                    JointResponse { excess: excess.im - x.moment.re * excess.re, ..y };
            }
        }
    }

    /// The second outward pass: the accelerations \[rad/s², m/s²\] of all coordinates, or M⁻¹ of the load
    /// whose e are in place.
    #[inline]
    pub fn outward_pass(&mut self, links: &Links, alpha: &mut [T]) {
        let all = &links.links[..];
        let n = all.len();
        let (places, joints, hinges) = (&self.places[..n], &self.joints[..], &mut self.hinge[..n]);
        let (mut a, mut turn) = (Complex::ZERO, T::ZERO);
        for k in 1..n {
            let (link, here, joint) = (&all[k], &places[k], &joints[all[k].body]);
            if link.parent + 1 != k {
                (a, turn) = match link.parent {
                    0 => (Complex::ZERO, T::ZERO),
                    parent => (hinges[parent], alpha[all[parent].body]),
                };
            }
            if link.origin_point != 0 {
                let [x, y] = [&joints[link.origin_point], &joints[link.origin_point + 1]];
                let up = y.excess * y.pivot;
                a = Complex::new(x.excess * x.pivot - x.moment.re * up, up);
                (alpha[link.origin_point], alpha[link.origin_point + 1]) = (a.re, a.im);
            }
            a += here.lever.times(turn);
            turn = (joint.excess - joint.moment.dot(a)) * joint.pivot;
            hinges[k] = a;
            alpha[link.body] = turn;
        }
    }

    /// Forgets the load: what [`outward_pass`](Self::outward_pass) makes of it is zero then.
    pub fn unburden(&mut self) {
        for joint in &mut self.joints {
            joint.excess = T::ZERO;
        }
    }

    /// Writes the reciprocal pivots of M \[1/(kg·m²), 1/kg\].
    pub fn pivots(&self, pivots: &mut [T]) {
        for (pivot, joint) in pivots.iter_mut().zip(&self.joints) {
            *pivot = joint.pivot;
        }
    }
}
