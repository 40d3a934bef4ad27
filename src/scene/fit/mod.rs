//! Whether the parts of a scene fit together: the motors and locks leave each angle one master, the start
//! agrees with their laws, every coordinate has an equation, and nothing begins where its force or its side
//! is undefined.

mod configuration;
mod start;

pub(super) use start::written_starts;

use super::error::SceneError;
use super::read::{At, GivenStart};
use super::{Bar, Place, Scene};

/// A start and a law that differ by less than this, relative to 1 or the value, are the same.
const SAME: f64 = 1e-12;

/// Where in the file the parts of a scene stand.
pub(super) struct Places<'a> {
    pub root: &'a At<'a>,
    pub bars: &'a [At<'a>],
    pub locks: &'a [At<'a>],
    pub springs: &'a [At<'a>],
    pub motors: &'a [At<'a>],
    pub walls: &'a [At<'a>],
}

/// The scene with its start, where its parts fit together.
pub(super) fn fitted(
    scene: Scene,
    places: &Places,
    given: &[Option<GivenStart>],
) -> Result<Scene, SceneError> {
    let hanging = Hanging::of(&scene);
    let whole = hanging.has_whole_start(&scene);
    let point_mass = if whole { hanging.turns_nothing(&scene.bars) } else { turns_alone(&scene) };
    if let Some(bar) = point_mass {
        let has_hinge =
            scene.hinges.iter().flat_map(|hinge| hinge.between).any(|place| place.bar == Some(bar));
        let (on_hinge, or_centre) =
            if has_hinge { (" on its own hinge", ", or a centre away from its hinge") } else { ("", "") };
        return Err(places.bars[bar].refuse(
            &format!("(bar `{}`) is a point mass{on_hinge}", scene.bars[bar].name),
            "turning a bar must move some mass, else its angle has no equation",
            &format!("give it an inertia{or_centre}"),
        ));
    }
    for (bar, entry) in given.iter().enumerate().filter(|(bar, _)| hanging.hung[body(Some(*bar))]) {
        for key in ["origin", "velocity"] {
            if let Some(at) = entry.as_ref().and_then(|entry| entry.fields.optional(key)) {
                let problem = format!("is given, but bar `{}` hangs on the ground", scene.bars[bar].name);
                let allowed = "only a bar that no hinge or weld ties to the ground, by itself or through \
                    others, has it to give";
                return Err(at.refuse(&problem, allowed, "leave it out; it follows from the angles"));
            }
        }
    }
    let (start, said) = start::starts(&scene, places, given, whole)?;
    if whole {
        let configuration = hanging.configuration(&start);
        configuration::springs(&configuration, &scene.springs, places.springs)?;
        configuration::walls(&configuration, &scene, places.walls)?;
    }
    Ok(Scene { start, given: said, ..scene })
}

impl Scene {
    /// True where the start is known from angles and rates alone, all of which must be given or follow from
    /// motors and locks: trees of hinges on the ground whose only constraints are angles, no rigid spring
    /// among them.  In every other scene a part of the start can be found from the rest.
    pub fn has_whole_start(&self) -> bool {
        Hanging::of(self).has_whole_start(self)
    }
}

/// How the bars hang on the ground.
struct Hanging {
    /// The bars that hang there, each after the one it hangs on, by the fewest hinges and welds.
    order: Vec<HungBar>,
    /// The bodies that hang there, the ground first.
    hung: Vec<bool>,
    /// True where a hinge or a weld closes a loop.
    looped: bool,
}

/// How one bar hangs.
struct HungBar {
    bar: usize,
    /// The body it hangs on and the point there.
    from: Place,
    /// The point of this bar.
    own: [f64; 2],
}

impl Hanging {
    fn of(scene: &Scene) -> Self {
        let bars = scene.bars.len();
        let joints: Vec<&[Place; 2]> = scene
            .hinges
            .iter()
            .filter(|hinge| !scene.is_inactive(&hinge.name))
            .map(|hinge| &hinge.between)
            .chain(scene.welds.iter().map(|weld| &weld.between))
            .collect();
        let mut groups = Groups::of(bars + 1);
        let mut looped = false;
        let mut at_body: Vec<Vec<usize>> = vec![Vec::new(); bars + 1];
        for (number, between) in joints.iter().enumerate() {
            let [a, b] = between.map(|place| body(place.bar));
            looped |= !groups.join(a, b);
            at_body[a].push(number);
            at_body[b].push(number);
        }
        let mut order: Vec<HungBar> = Vec::with_capacity(bars);
        let mut hung = vec![false; bars + 1];
        hung[0] = true;
        let mut reached = vec![None];
        let mut next = 0;
        while let Some(&here) = reached.get(next) {
            next += 1;
            for &number in &at_body[body(here)] {
                let [a, b] = *joints[number];
                let (from, to) = if a.bar == here { (a, b) } else { (b, a) };
                let Some(bar) = to.bar else { continue };
                if !hung[body(to.bar)] {
                    hung[body(to.bar)] = true;
                    reached.push(to.bar);
                    order.push(HungBar { bar, from, own: to.point });
                }
            }
        }
        Self { order, hung, looped }
    }

    fn has_whole_start(&self, scene: &Scene) -> bool {
        let only_angles = scene.sliders.is_empty() && scene.welds.is_empty() && scene.drives.is_empty();
        let only_angles = only_angles && !scene.springs.iter().any(|spring| spring.rigid);
        let angles_known =
            scene.locks.iter().all(|lock| lock.angle.is_some() || scene.is_inactive(&lock.name));
        only_angles
            && scene.couplings.is_empty()
            && angles_known
            && !self.looped
            && self.order.len() == scene.bars.len()
    }

    /// A bar of a tree on the ground that moves no mass when it turns.
    fn turns_nothing(&self, bars: &[Bar]) -> Option<usize> {
        let mut turns_nothing: Vec<bool> = bars.iter().map(|bar| bar.inertia == 0.0).collect();
        let mut own = vec![[0.0; 2]; bars.len()];
        for hang in &self.order {
            own[hang.bar] = hang.own;
            turns_nothing[hang.bar] &= bars[hang.bar].centre == hang.own;
        }
        for hang in &self.order {
            if let Some(parent) = hang.from.bar {
                turns_nothing[parent] &= hang.from.point == own[parent];
            }
        }
        turns_nothing.iter().position(|&nothing| nothing)
    }
}

/// A bar of any scene that has no inertia, no hinge away from its centre, and nothing that holds its angle.
fn turns_alone(scene: &Scene) -> Option<usize> {
    let mut alone: Vec<bool> = scene.bars.iter().map(|bar| bar.inertia == 0.0).collect();
    for place in scene.hinges.iter().flat_map(|hinge| hinge.between) {
        if let Some(bar) = place.bar {
            alone[bar] &= place.point == scene.bars[bar].centre;
        }
    }
    let sliding = scene.sliders.iter().flat_map(|slider| [slider.point.bar, slider.rail.place.bar]);
    let welded = scene.welds.iter().flat_map(|weld| weld.between.map(|place| place.bar));
    let locked = scene.locks.iter().flat_map(|lock| [Some(lock.bar), lock.relative_to]);
    let driven = scene.motors.iter().flat_map(|motor| [Some(motor.bar), motor.relative_to]);
    for bar in sliding.chain(welded).chain(locked).chain(driven).flatten() {
        alone[bar] = false;
    }
    alone.iter().position(|&alone| alone)
}

/// The ground is body 0.
pub(super) fn body(bar: Option<usize>) -> usize {
    bar.map_or(0, |bar| bar + 1)
}

/// Bodies that are joined, as a forest with path halving.
pub(super) struct Groups(Vec<usize>);

impl Groups {
    pub fn of(count: usize) -> Self {
        Self((0..count).collect())
    }

    pub fn find(&mut self, mut body: usize) -> usize {
        while self.0[body] != body {
            self.0[body] = self.0[self.0[body]];
            body = self.0[body];
        }
        body
    }

    /// False where the two were joined before.
    pub fn join(&mut self, a: usize, b: usize) -> bool {
        let (a, b) = (self.find(a), self.find(b));
        self.0[a] = b;
        a != b
    }
}
