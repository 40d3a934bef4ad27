//! What a changed length leaves where it is: a bar's points are given by their coordinates, not by its ends.

use super::{Place, Scene};

/// Most points that a note names.
const NAMED: usize = 4;

/// A note at the path of a value that is set or varied, where that is the length of a bar with points that
/// stay where the scene puts them: hinges, ends of springs, points of forces, …; not its origin, nor a point
/// at the new end.
///
/// The path is whole, as [`Template::variable`](super::Template::variable) makes it; `length` \[m\] is what
/// the bar gets, where that is one value.
pub fn points_that_stay(scene: &Scene, path: &str, length: Option<f64>) -> Option<String> {
    let holder = path.strip_prefix("bars")?.strip_suffix(".length")?;
    let bar = match holder.strip_prefix('.') {
        Some(name) => scene.bars.iter().position(|bar| bar.name == name)?,
        None => holder
            .strip_prefix('[')?
            .strip_suffix(']')?
            .parse()
            .ok()
            .filter(|&bar: &usize| bar < scene.bars.len())?,
    };
    let stays = |place: &Place| {
        place.bar == Some(bar)
            && place.point != [0.0, 0.0]
            && Some(place.point) != length.map(|length| [length, 0.0])
    };
    let found: Vec<String> = (places(scene).into_iter().filter(|(_, place)| stays(place)))
        .map(|(path, Place { point: [x, y], .. })| format!("{path} = [{x}, {y}]"))
        .collect();
    if found.is_empty() {
        return None;
    }
    let more = if found.len() > NAMED { format!(" and {} more", found.len() - NAMED) } else { String::new() };
    let them = if found.len() == 1 { "it stays" } else { "they stay" };
    let list = found.iter().take(NAMED).cloned().collect::<Vec<_>>().join(", ");
    let word = if found.len() == 1 { "point" } else { "points" };
    Some(format!(
        "{path} does not move the {word} {list}{more}: {them} on the bar where the scene says; set or vary \
            coordinates to move points"
    ))
}

/// Every place of the scene that lies on something, with its path.
pub(super) fn places(scene: &Scene) -> Vec<(String, Place)> {
    let pairs = (scene.hinges.iter().map(|hinge| ("hinges", &hinge.name, &hinge.between)))
        .chain(scene.welds.iter().map(|weld| ("welds", &weld.name, &weld.between)))
        .chain(scene.springs.iter().map(|spring| ("springs", &spring.name, &spring.between)));
    let between = |(list, name, places): (&str, &String, &[Place; 2])| {
        let path = |end: usize| (format!("{list}.{name}.between[{end}].point"), places[end]);
        [path(0), path(1)]
    };
    let sliders = scene.sliders.iter().flat_map(|slider| {
        let name = &slider.name;
        [
            (format!("sliders.{name}.point.point"), slider.point),
            (format!("sliders.{name}.rail.point"), slider.rail.place),
        ]
    });
    let on = |list: &str, name: &String, bar: usize, point: [f64; 2]| {
        (format!("{list}.{name}.point"), Place { bar: Some(bar), point })
    };
    let forces = scene.forces.iter().map(|force| on("forces", &force.name, force.bar, force.point));
    let walls = scene.walls.iter().map(|wall| on("walls", &wall.name, wall.bar, wall.point));
    pairs.flat_map(between).chain(sliders).chain(forces).chain(walls).collect()
}
