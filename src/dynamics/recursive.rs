//! The hinge tree body by body: accelerations in a number of operations proportional to the number of bodies.
//!
//! What hangs on a hinge answers an acceleration `a` of the hinge with the force `R = A a + b` on it: a symmetric apparent mass A (2 × 2) and a
//! force b, whatever the joints beyond are free to do.  Both are found from the outermost bodies inwards; then the accelerations follow outwards.
//!
//! ```text
//! u_k = i z_p r_k     lever of hinge k about the hinge of its parent p: O_k' = O_p' + u_k w_p
//! n_k = n_p + i u_k w_p²,  n_ground = -g           hinge acceleration where no angle accelerates, gravity taken along
//! h_k = i m z_k c_k,   f_k = m n_k + i h_k w_k² - F_k,   t_k = T_k - h_k·n_k        of the body alone, with a force F and a torque T on it
//!
//! inwards:   A = m + Σ A_j,   h = h_k + Σ A_j u_j,   d = I + m |c|² + Σ u_j·A_j u_j,   f = f_k + Σ b_j,   e = t_k - Σ u_j·b_j
//!            A_k = A - h hᵀ/d,   b_k = f + h e/d
//! outwards:  alpha_k = (e - h·a_k)/d,   a_j = a_k + u_j alpha_k,   a_ground = 0
//! ```
//!
//! Sums run over the bodies j that hang on k; r is the hinge on the parent and c the centre of mass, both from the body's own hinge in the body's
//! directions; a·b is the dot product of the plane, and `i x · y` the moment of y with the arm x.  The true acceleration of hinge k is n_k + a_k.
//!
//! Eliminated this way M is `(1 + K) D (1 + K)ᵀ` with D the diagonal of the d: the vectors e belong to the inner factor, and for generalized
//! loads Q, P on the angles `Qᵀ M⁻¹ P = Σ e_Q e_P / d`.
//!
//! Source: R. Featherstone, *Rigid Body Dynamics Algorithms* (2008), section 7.3, the articulated-body algorithm; the factors are those of
//! G. Rodriguez, *Kalman filtering, smoothing and recursive robot arm forward and inverse dynamics*, IEEE J. Robotics Autom. 3 (1987).  In the
//! plane, in absolute angles and with forces taken at the hinges, a hinge passes on no moment, so that two by two numbers suffice; this reduction,
//! and the products with u taken before the division is done (it is what the recursion waits for), are ours.

use crate::arithmetic::{Complex, Real, Scalar};

/// A body as it hangs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hung {
    /// The body it hangs on; `None`: the ground.
    pub parent: Option<usize>,
    /// Its hinge on the parent: from the parent's own hinge, in the parent's directions \[m\]; on the ground any place serves.
    pub hinge: Complex<f64>,
    /// Centre of mass from the body's own hinge, in its directions \[m\].
    pub centre: Complex<f64>,
    /// Mass \[kg\].
    pub mass: f64,
    /// Moment of inertia about the centre of mass \[kg·m²\].
    pub inertia: f64,
}

/// A body in the order of the tree: every branch in one piece, inner bodies first, the ground before all.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Link {
    /// Its number in the scene.
    body: usize,
    /// Place of the parent; 0: the ground.
    parent: usize,
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

/// The constants of a tree of n bodies in n numbers of a kind.
#[derive(Clone, Debug, PartialEq)]
pub struct Links {
    /// The ground, then the bodies.
    links: Vec<Link>,
    /// Gravity \[m/s²\].
    gravity: Complex<f64>,
}

impl Links {
    /// Puts bodies in the order of the tree; `None` where some do not hang on the ground.
    pub fn new(bodies: &[Hung], gravity: Complex<f64>) -> Option<Self> {
        let n = bodies.len();
        // Children of each place: a list from the last to the first.
        let (mut last, mut before) = (vec![0; n + 1], vec![0; n + 1]);
        for (k, body) in bodies.iter().enumerate() {
            let parent = body.parent.map_or(0, |parent| parent + 1);
            (before[k + 1], last[parent]) = (last[parent], k + 1);
        }
        let has_one = |slot: usize| last[slot] != 0 && before[last[slot]] == 0;
        let ground =
            Link { body: 0, parent: 0, hinge: Complex::ZERO, moment: Complex::ZERO, mass: 0.0, inertia: 1.0, forks: true, alone: false };
        let mut links = Vec::with_capacity(n + 1);
        let mut place = vec![0; n + 1];
        let mut front = vec![0];
        while let Some(slot) = front.pop() {
            place[slot] = links.len();
            links.push(match slot {
                0 => ground,
                _ => {
                    let Hung { parent, hinge, centre, mass, inertia } = bodies[slot - 1];
                    let parent = parent.map_or(0, |parent| parent + 1);
                    Link {
                        body: slot - 1,
                        parent: place[parent],
                        hinge,
                        moment: centre.left().times(mass),
                        mass,
                        inertia: inertia + mass * centre.norm_squared(),
                        forks: last[slot] != 0 && !has_one(slot),
                        alone: parent != 0 && has_one(parent),
                    }
                }
            });
            let mut child = last[slot];
            while child != 0 {
                front.push(child);
                child = before[child];
            }
        }
        (links.len() == n + 1).then_some(Self { links, gravity })
    }

    /// Number of bodies.
    pub fn bodies(&self) -> usize {
        self.links.len() - 1
    }
}

/// A body at one moment: what its motion alone asks for.
#[derive(Clone, Copy, Debug, Default)]
struct Place<T> {
    /// z.
    z: Complex<T>,
    /// u \[m\].
    lever: Complex<T>,
    /// n \[m/s²\].
    drift: Complex<T>,
    /// h of the body alone \[kg·m\].
    moment: Complex<T>,
    /// f of the body alone \[N\].
    force: Complex<T>,
    /// t of the body alone \[N·m\].
    torque: T,
}

/// A body after the inward pass.
#[derive(Clone, Copy, Debug, Default)]
struct Joint<T> {
    /// h \[kg·m\].
    moment: Complex<T>,
    /// 1/d \[1/(kg·m²)\].
    pivot: T,
    /// e \[N·m\].
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
/// An evaluation is [`face`](Self::face), [`convect`](Self::convect), any number of [`push`](Self::push) and [`twist`](Self::twist),
/// [`fold`](Self::fold), [`unfold`](Self::unfold).
#[derive(Clone, Debug)]
pub struct Recursive<T> {
    /// Unit vectors in the scene's order (n).
    pub z: Vec<Complex<T>>,
    /// Place of each body (n).
    place: Vec<usize>,
    /// The ground, then the bodies.
    places: Vec<Place<T>>,
    joints: Vec<Joint<T>>,
    /// Sums over the bodies that hang on a fork; zero between evaluations.
    forks: Vec<Outer<T>>,
    /// a \[m/s²\].
    hinge: Vec<Complex<T>>,
    /// alpha \[rad/s²\].
    alpha: Vec<T>,
}

impl<T: Real> Recursive<T> {
    /// Scratch space for these bodies.
    pub fn new(links: &Links) -> Self {
        let n = links.bodies();
        let mut place = vec![0; n];
        for (k, link) in links.links.iter().enumerate().skip(1) {
            place[link.body] = k;
        }
        Self {
            z: vec![Complex::ZERO; n],
            place,
            places: vec![Place::default(); n + 1],
            joints: vec![Joint::default(); n + 1],
            forks: vec![Outer::default(); n + 1],
            hinge: vec![Complex::ZERO; n + 1],
            alpha: vec![T::ZERO; n + 1],
        }
    }

    /// Unit vectors of these angles \[rad\], in the scene's order.
    #[inline]
    pub fn face(&mut self, phi: &[T]) {
        T::units(phi, &mut self.z);
    }

    /// The first outward pass, at the unit vectors in `z`: levers, velocity terms, gravity; forgets all forces.
    #[inline]
    pub fn convect(&mut self, links: &Links, omega: &[T]) {
        let all = &links.links[..];
        let n = all.len();
        let places = &mut self.places[..n];
        let (mut z, mut square) = (Complex::new(T::ONE, T::ZERO), T::ZERO);
        let mut drift = -Complex::of(links.gravity);
        places[0] = Place { z, drift, ..Place::default() };
        for k in 1..n {
            let link = &all[k];
            if link.parent + 1 != k {
                let parent = &places[link.parent];
                (z, drift) = (parent.z, parent.drift);
                square = match link.parent {
                    0 => T::ZERO,
                    parent => omega[all[parent].body] * omega[all[parent].body],
                };
            }
            let lever = z.turn(link.hinge).left();
            drift += lever.left().times(square);
            let w = omega[link.body];
            (z, square) = (self.z[link.body], w * w);
            let moment = z.turn(link.moment);
            let force = drift.times(T::of(link.mass)) + moment.left().times(square);
            places[k] = Place { z, lever, drift, moment, force, torque: -moment.dot(drift) };
        }
    }

    /// A force \[N\] on a body, its point `arm` \[m\] away from the body's own hinge in the world's directions.
    #[inline]
    pub fn push(&mut self, body: usize, arm: Complex<T>, force: Complex<T>) {
        let place = &mut self.places[self.place[body]];
        place.force = place.force - force;
        place.torque += arm.cross(force);
    }

    /// A torque \[N·m\] on a body.
    #[inline]
    pub fn twist(&mut self, body: usize, torque: T) {
        self.places[self.place[body]].torque += torque;
    }

    /// The inward pass: factors of M, and what is left of the torques.
    #[inline]
    pub fn fold(&mut self, links: &Links) {
        let all = &links.links[..];
        let n = all.len();
        let (places, joints, forks) = (&self.places[..n], &mut self.joints[..n], &mut self.forks[..n]);
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
            // With the lever, before the hinge has given way.
            let rigid = mass.times(u);
            let (inertia, across, torque) = (u.dot(rigid), moment.dot(u), u.dot(force));
            let share = moment.times(pivot);
            joints[k] = Joint { moment, pivot, excess };
            let felt = Outer {
                mass: Symmetric {
                    xx: mass.xx - share.re * moment.re,
                    xy: mass.xy - share.re * moment.im,
                    yy: mass.yy - share.im * moment.im,
                },
                moment: rigid - moment.times(across * pivot),
                inertia: inertia - across * across * pivot,
                force: force + share.times(excess),
                torque: torque + across * pivot * excess,
            };
            if link.alone {
                outer = felt;
            } else {
                forks[link.parent].join(felt);
                outer = Outer::default();
            }
        }
    }

    /// The second outward pass: accelerations \[rad/s²\], in the scene's order.
    #[inline]
    pub fn unfold(&mut self, links: &Links, alpha: &mut [T]) {
        let all = &links.links[..];
        let n = all.len();
        let (places, joints) = (&self.places[..n], &self.joints[..n]);
        let (hinges, alphas) = (&mut self.hinge[..n], &mut self.alpha[..n]);
        let (mut a, mut turn) = (Complex::ZERO, T::ZERO);
        for k in 1..n {
            let (link, here, joint) = (&all[k], &places[k], &joints[k]);
            if link.parent + 1 != k {
                (a, turn) = (hinges[link.parent], alphas[link.parent]);
            }
            a += here.lever.times(turn);
            turn = (joint.excess - joint.moment.dot(a)) * joint.pivot;
            hinges[k] = a;
            alphas[k] = turn;
            alpha[link.body] = turn;
        }
    }

    /// Accelerations \[rad/s²\] under gravity alone, in the scene's order.
    #[inline]
    pub fn accelerate(&mut self, links: &Links, phi: &[T], omega: &[T], alpha: &mut [T]) {
        self.face(phi);
        self.convect(links, omega);
        self.fold(links);
        self.unfold(links, alpha);
    }
}
