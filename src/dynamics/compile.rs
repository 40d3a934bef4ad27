//! Scene to mechanism: the hinge tree, its constant matrices, and what the scene does not need left out.

use super::force::Spring;
use super::impact::Contact;
use super::kernel::Kernel;
use super::point::Point;
use super::row::{AngleRow, LineRow, PinRow, Row};
use super::ties::Ties;
use super::tree::{self, Tree};
use crate::arithmetic::Complex;
use crate::scene::{Place, Scene};

/// The largest number of bodies the dense form takes; its matrices hold n² numbers.
pub const DENSE_LIMIT: usize = 2000;

/// A scene's equations: constants only, shared by every form and method.
#[derive(Clone, Debug, PartialEq)]
pub struct Mechanism {
    /// Bodies in the order of the scene's bars.
    pub bodies: Vec<Body>,
    /// Hinges in the order of the scene.
    pub joints: Vec<Joint>,
    /// The hinge tree's matrices.
    pub tree: Tree,
    /// Springs and dampers.
    pub springs: Vec<Spring>,
    /// Constraint rows: one per motor, then one per contact that is held.
    pub rows: Vec<Row>,
    /// Walls.
    pub contacts: Vec<Contact>,
    /// The contacts held, by number, in the order of their rows; none as compiled: see [`Mechanism::holding`].
    pub held: Vec<usize>,
    /// The driven angles solved for: coordinates left when the rows are eliminated.
    pub ties: Ties,
    /// Gravity \[m/s²\].
    pub gravity: Complex<f64>,
    /// What energies are divided by in reports \[J\]: see [`Mechanism::energy_scale`](super::energy).
    pub energy_scale: f64,
}

/// A body of the mechanism.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    /// Name in the scene.
    pub name: String,
    /// Mass \[kg\].
    pub mass: f64,
    /// Moment of inertia about the centre of mass \[kg·m²\].
    pub inertia: f64,
    /// Centre of mass.
    pub centre: Point,
    /// Both ends of the bar, for drawings.
    pub ends: [Point; 2],
    /// The body it hangs on; `None`: the ground.
    pub parent: Option<usize>,
}

/// A hinge of the tree.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    /// Name in the scene.
    pub name: String,
    /// Where it is.
    pub point: Point,
    /// The body that hangs on it.
    pub outer: usize,
    /// The scene's first and second body at this hinge; `None` for the ground.
    pub between: [Option<usize>; 2],
}

/// Why a scene has no equations.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CompileError {
    /// A bar is not connected to the ground by hinges.
    #[error("bar `{0}` does not hang on the ground through hinges")]
    Loose(String),
    /// A hinge closes a loop.
    #[error("hinge `{0}` closes a loop of bodies; only trees of hinged bodies are supported")]
    Loop(String),
    /// Motors give the same angle twice.
    #[error("motor `{0}` gives an angle that the other motors give already")]
    Redundant(String),
    /// Too many bodies for the dense form.
    #[error("{0} bodies; the dense form takes at most {DENSE_LIMIT}")]
    TooMany(usize),
    /// The mass matrix is singular: some body has no inertia about its hinge.
    #[error("the mass matrix is singular at the start: bar `{0}` and what hangs on it have no inertia about its hinge")]
    Massless(String),
}

impl Mechanism {
    /// Compiles a scene.
    ///
    /// # Errors
    /// What the reader of scenes refuses too (loops, loose bars, doubled motors), a singular mass matrix, or too many bodies.
    pub fn new(scene: &Scene) -> Result<Self, CompileError> {
        let n = scene.bars.len();
        if n > DENSE_LIMIT {
            return Err(CompileError::TooMany(n));
        }
        let hung = hang(scene)?;
        let place = |place: &Place| match place.bar {
            None => Point::ground(place.point),
            Some(bar) => hung[bar].place(bar, place.point),
        };
        let bodies: Vec<Body> = scene
            .bars
            .iter()
            .enumerate()
            .map(|(k, bar)| Body {
                name: bar.name.clone(),
                mass: bar.mass,
                inertia: bar.inertia,
                centre: hung[k].place(k, bar.centre),
                ends: [hung[k].place(k, [0.0, 0.0]), hung[k].place(k, [bar.length, 0.0])],
                parent: hung[k].parent,
            })
            .collect();
        let gravity = Complex::new(scene.gravity[0], scene.gravity[1]);
        let joints = scene
            .hinges
            .iter()
            .enumerate()
            .map(|(h, hinge)| {
                let outer = hung.iter().position(|hung| hung.hinge == h).unwrap_or(0);
                Joint {
                    name: hinge.name.clone(),
                    point: hung[outer].hinge_point.clone(),
                    outer,
                    between: [hinge.between[0].bar, hinge.between[1].bar],
                }
            })
            .collect();
        let springs = scene
            .springs
            .iter()
            .map(|spring| Spring {
                name: spring.name.clone(),
                bodies: [spring.between[0].bar, spring.between[1].bar],
                span: place(&spring.between[0]).minus(&place(&spring.between[1])),
                stiffness: spring.stiffness,
                free_length: spring.free_length,
                damping: spring.damping,
            })
            .collect();
        let rows = scene
            .motors
            .iter()
            .map(|motor| {
                Row::Angle(AngleRow { name: motor.name.clone(), body: motor.bar, base: motor.relative_to, law: motor.law.clone() })
            })
            .collect();
        let contacts = scene
            .walls
            .iter()
            .map(|wall| {
                let normal = Complex::new(wall.normal[0], wall.normal[1]);
                let offset = normal.dot(Complex::new(wall.through[0], wall.through[1]));
                let point = hung[wall.bar].place(wall.bar, wall.point);
                Contact { row: LineRow { name: wall.name.clone(), point, normal, offset }, restitution: wall.restitution }
            })
            .collect();
        let mut mechanism = Self {
            tree: constants(&bodies, gravity),
            bodies,
            joints,
            springs,
            rows,
            contacts,
            held: Vec::new(),
            ties: Ties::new(scene)?,
            gravity,
            energy_scale: 1.0,
        };
        mechanism.check_mass(scene)?;
        mechanism.energy_scale = mechanism.scale_of_energy(&mechanism.start(scene));
        Ok(mechanism)
    }

    /// The mechanism with two of its points pinned to one another by two more rows: a closed loop.
    ///
    /// The loop must be closed at the start, and not be one that the rows there are close already.
    pub fn pinned(&self, name: &str, a: &Point, b: &Point) -> Self {
        let mut mechanism = self.clone();
        let before_contacts = mechanism.motor_rows();
        mechanism.rows.splice(before_contacts..before_contacts, PinRow::pair(name, a, b).map(Row::Pin));
        mechanism
    }

    /// True where the scene has a damper.
    pub fn is_damped(&self) -> bool {
        self.springs.iter().any(|spring| spring.damping != 0.0)
    }

    /// True where motors or dampers do work, so that a form must keep account of it.
    pub fn keeps_account(&self) -> bool {
        !self.rows.is_empty() || self.is_damped()
    }

    /// The mass matrix at the start must be positive definite.
    fn check_mass(&self, scene: &Scene) -> Result<(), CompileError> {
        let n = self.bodies.len();
        let phi: Vec<f64> = scene.start.iter().map(|start| start.phi).collect();
        let mut kernel = Kernel::<f64>::new(n, 0);
        kernel.face::<0>(&phi);
        self.tree.couple::<f64, 0>(&kernel.z, &mut kernel.mass, &mut kernel.twist);
        tree::factor::<f64, 0>(n, &mut kernel.mass, &mut kernel.pivot);
        let singular = |&k: &usize| {
            // Not a number counts as singular.
            let sound = 1.0 / (kernel.pivot[k] * self.tree.diagonal[k]) > 1e-13;
            !sound
        };
        match (0..n).find(singular) {
            Some(k) => Err(CompileError::Massless(self.bodies[k].name.clone())),
            None => Ok(()),
        }
    }
}

/// How a body hangs in the tree.
struct Hung {
    /// The parent; `None`: the ground.
    parent: Option<usize>,
    /// Index of its hinge.
    hinge: usize,
    /// The hinge as a point of the parent.
    hinge_point: Point,
    /// The hinge in the body's own frame \[m\].
    own: [f64; 2],
}

impl Hung {
    /// A point of body `body`, given in its frame \[m\].
    fn place(&self, body: usize, point: [f64; 2]) -> Point {
        self.hinge_point.along(body, Complex::new(point[0] - self.own[0], point[1] - self.own[1]))
    }
}

/// The hinge tree, breadth first from the ground: least depth.
fn hang(scene: &Scene) -> Result<Vec<Hung>, CompileError> {
    let mut hung: Vec<Option<Hung>> = scene.bars.iter().map(|_| None).collect();
    let mut used = vec![false; scene.hinges.len()];
    let mut at: Vec<Vec<usize>> = vec![Vec::new(); scene.bars.len() + 1];
    let slot = |bar: Option<usize>| bar.map_or(0, |bar| bar + 1);
    for (h, hinge) in scene.hinges.iter().enumerate() {
        for place in &hinge.between {
            at[slot(place.bar)].push(h);
        }
    }
    let mut queue = std::collections::VecDeque::from([None]);
    while let Some(inner) = queue.pop_front() {
        for &h in &at[slot(inner)] {
            if used[h] {
                continue;
            }
            used[h] = true;
            let [a, b] = &scene.hinges[h].between;
            let (near, far) = if a.bar == inner { (a, b) } else { (b, a) };
            let Some(outer) = far.bar.filter(|&bar| hung[bar].is_none() && far.bar != inner) else {
                return Err(CompileError::Loop(scene.hinges[h].name.clone()));
            };
            let hinge_point = match inner {
                None => Point::ground(near.point),
                Some(parent) => match &hung[parent] {
                    Some(body) => body.place(parent, near.point),
                    None => return Err(CompileError::Loose(scene.bars[parent].name.clone())),
                },
            };
            hung[outer] = Some(Hung { parent: inner, hinge: h, hinge_point, own: far.point });
            queue.push_back(Some(outer));
        }
    }
    hung.into_iter().zip(&scene.bars).map(|(hung, bar)| hung.ok_or_else(|| CompileError::Loose(bar.name.clone()))).collect()
}

/// H, d and the weights.
fn constants(bodies: &[Body], gravity: Complex<f64>) -> Tree {
    let n = bodies.len();
    let mut coupling = vec![Complex::ZERO; n * n];
    let mut diagonal: Vec<f64> = bodies.iter().map(|body| body.inertia).collect();
    let mut weight = vec![Complex::ZERO; n];
    for body in bodies {
        for (place, &(i, gamma)) in body.centre.terms.iter().enumerate() {
            diagonal[i] += body.mass * gamma.norm_squared();
            weight[i] += (gamma.conj() * gravity).times(body.mass);
            for &(j, other) in &body.centre.terms[place + 1..] {
                coupling[i * n + j] += (gamma.conj() * other).times(body.mass);
            }
        }
    }
    let off_axis = coupling.iter().any(|h| h.im != 0.0);
    Tree { bodies: n, coupling, diagonal, weight, off_axis }
}
