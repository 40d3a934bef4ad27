//! The hinges as a forest: which body hangs on which, which hinges close loops, which bodies hang on nothing.
//!
//! Breadth first from the ground, then from the first body of every group that is left: the depth is the least there is, and with it the number of
//! couplings.  Nobody chooses the tree; a hinge between bodies that are connected already becomes a pin.

use super::point::Point;
use super::row::Site;
use crate::arithmetic::{Complex, Scalar};
use crate::scene::{Place, Scene};

/// Where the foot of a body is: the point it hangs on, from which its points are counted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Foot {
    /// A point of the ground \[m\].
    Ground(Complex<f64>),
    /// A point of another body, counted from that body's foot \[m\].
    On(usize, Complex<f64>),
    /// A point that moves freely, with coordinates x and the one after it.
    Free(usize),
}

impl Foot {
    /// The body it is on.
    pub fn parent(&self) -> Option<usize> {
        if let Self::On(parent, _) = self { Some(*parent) } else { None }
    }
}

/// How a body hangs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hang {
    /// Its foot.
    pub foot: Foot,
    /// The foot in the body's own frame \[m\].
    pub own: Complex<f64>,
}

/// The forest of a scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Forest {
    /// How each body hangs.
    pub hangs: Vec<Hang>,
    /// The bodies, each after the one it hangs on.
    pub order: Vec<usize>,
    /// The body that hangs on each hinge, then on each weld; `None` where it closes a loop.
    pub outer: Vec<Option<usize>>,
    /// Number of coordinates: angles, and two for each foot that moves freely.
    pub coordinates: usize,
}

impl Forest {
    /// The forest of a scene's hinges and welds.
    pub fn new(scene: &Scene) -> Self {
        let n = scene.bars.len();
        let joints: Vec<&[Place; 2]> =
            scene.hinges.iter().map(|hinge| &hinge.between).chain(scene.welds.iter().map(|weld| &weld.between)).collect();
        let slot = |bar: Option<usize>| bar.map_or(0, |bar| bar + 1);
        let mut at: Vec<Vec<usize>> = vec![Vec::new(); n + 1];
        for (joint, between) in joints.iter().enumerate() {
            for place in *between {
                at[slot(place.bar)].push(joint);
            }
        }
        let mut hangs: Vec<Option<Hang>> = vec![None; n];
        let mut outer = vec![None; joints.len()];
        let (mut order, mut coordinates) = (Vec::with_capacity(n), n);
        for root in std::iter::once(None).chain((0..n).map(Some)) {
            if let Some(body) = root {
                if hangs[body].is_some() {
                    continue;
                }
                hangs[body] = Some(Hang { foot: Foot::Free(coordinates), own: Complex::ZERO });
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
                    let foot = match inner.and_then(|parent| Some((parent, hangs[parent]?))) {
                        Some((parent, hang)) => Foot::On(parent, near - hang.own),
                        None => Foot::Ground(near),
                    };
                    hangs[body] = Some(Hang { foot, own: Complex::new(far.point[0], far.point[1]) });
                    outer[joint] = Some(body);
                    order.push(body);
                    front.push_back(Some(body));
                }
            }
        }
        Self { hangs: hangs.into_iter().flatten().collect(), order, outer, coordinates }
    }

    /// A place of the scene as a point, by walking up the tree.
    pub fn point(&self, place: &Place) -> Point {
        match place.bar {
            None => Point::ground(place.point),
            Some(bar) => self.walk(bar, Complex::new(place.point[0], place.point[1]) - self.hangs[bar].own),
        }
    }

    /// A point of a body, `offset` from its foot in its frame \[m\].
    pub fn walk(&self, body: usize, offset: Complex<f64>) -> Point {
        let mut path = vec![(body, offset)];
        let mut foot = self.hangs[body].foot;
        while let Foot::On(parent, offset) = foot {
            path.push((parent, offset));
            foot = self.hangs[parent].foot;
        }
        let mut point = match foot {
            Foot::Free(x) => Point::floating(x),
            Foot::Ground(at) => Point { root: at, ..Point::default() },
            Foot::On(..) => Point::default(),
        };
        path.sort_unstable_by_key(|term| term.0);
        path.retain(|term| term.1 != Complex::ZERO);
        point.terms = path;
        point
    }

    /// A place with the body it is on.
    pub fn site(&self, place: &Place) -> Site {
        Site { body: place.bar, point: self.point(place) }
    }

    /// The ground point that each body hangs from, one body on another; the origin where a foot moves freely \[m\].
    pub fn roots(&self) -> Vec<Complex<f64>> {
        let mut roots = vec![Complex::ZERO; self.hangs.len()];
        for &body in &self.order {
            roots[body] = match self.hangs[body].foot {
                Foot::Ground(at) => at,
                Foot::On(parent, _) => roots[parent],
                Foot::Free(_) => Complex::ZERO,
            };
        }
        roots
    }

    /// Writes the feet of all bodies at the elements `z`, outwards \[m\].
    #[inline(always)]
    pub fn feet<T: Scalar>(&self, z: &[Complex<T>], feet: &mut [Complex<T>]) {
        for &body in &self.order {
            feet[body] = match self.hangs[body].foot {
                Foot::Ground(at) => Complex::of(at),
                Foot::On(parent, offset) => feet[parent] + z[parent].turn(offset),
                Foot::Free(x) => z[x],
            };
        }
    }

    /// Writes the velocities of the feet \[m/s\].
    #[inline(always)]
    pub fn foot_velocities<T: Scalar>(&self, z: &[Complex<T>], omega: &[T], feet: &mut [Complex<T>]) {
        for &body in &self.order {
            feet[body] = match self.hangs[body].foot {
                Foot::Ground(_) => Complex::ZERO,
                Foot::On(parent, offset) => feet[parent] + z[parent].turn(offset).left().times(omega[parent]),
                Foot::Free(x) => Complex::new(omega[x], omega[x + 1]),
            };
        }
    }

    /// Writes the accelerations of the feet \[m/s²\].
    pub fn foot_accelerations<T: Scalar>(&self, z: &[Complex<T>], omega: &[T], alpha: &[T], feet: &mut [Complex<T>]) {
        for &body in &self.order {
            feet[body] = match self.hangs[body].foot {
                Foot::Ground(_) => Complex::ZERO,
                Foot::On(parent, offset) => feet[parent] + swing(z[parent].turn(offset), omega[parent], alpha[parent]),
                Foot::Free(x) => Complex::new(alpha[x], alpha[x + 1]),
            };
        }
    }
}

/// Acceleration \[m/s²\] of the end of an arm that turns.
pub fn swing<T: Scalar>(arm: Complex<T>, omega: T, alpha: T) -> Complex<T> {
    arm.left().times(alpha) - arm.times(omega * omega)
}
