//! The report of a moment as a page of text.

use super::{Inspection, Reaction};
use crate::report::page::{self, Page};
use crate::scene::Scene;

/// A figure.
fn figure(x: f64) -> String {
    if x.is_nan() { "not known".into() } else { page::figure(x) }
}

impl Inspection {
    /// The report as a page.
    pub fn text(&self, scene: &Scene) -> String {
        let mut page = Page::new(&scene.name, &scene.description);
        let row = |name: &str, values: &[f64]| {
            std::iter::once(name.to_owned()).chain(values.iter().map(|&x| figure(x))).collect()
        };
        let rows: Vec<Vec<String>> = self.bodies.iter().map(|(name, values)| row(name, values)).collect();
        let when = if self.t == 0.0 { "the start".to_owned() } else { format!("t = {} s", figure(self.t)) };
        page.entry("accelerations", &format!("of the centres of mass at {when}"));
        page.table(&["body", "x [m/s²]", "y [m/s²]", "phi [rad/s²]"], &rows);
        self.describe_constraints(&mut page);
        let rows: Vec<Vec<String>> = (self.hinges.iter())
            .map(|hinge| {
                vec![
                    hinge.name.clone(),
                    figure(hinge.force[0]),
                    figure(hinge.force[1]),
                    hinge.on.clone(),
                    hinge.from.clone(),
                ]
            })
            .collect();
        page.entry("hinges", "");
        page.table(&["name", "Fx [N]", "Fy [N]", "on", "from"], &rows);
        self.describe_open(&mut page);
        let [kinetic, potential] = self.energy;
        page.entry(
            "energy",
            &format!(
                "kinetic {} J, potential {} J, total {} J",
                figure(kinetic),
                figure(potential),
                figure(kinetic + potential)
            ),
        );
        let rows: Vec<Vec<String>> = (self.outputs.iter())
            .map(|(name, unit, value)| vec![name.clone(), figure(*value), unit.clone()])
            .collect();
        if !rows.is_empty() {
            page.entry("outputs", "");
            page.table(&["name", "value", "unit"], &rows);
        }
        for (name, mode, is_torque, [friction, pressing]) in &self.frictions {
            let (friction, unit) = (figure(-friction), if *is_torque { "N m" } else { "N" });
            let said = format!("{name} {mode}: {friction} {unit}, pressed by {} N", figure(*pressing));
            page.entry("dry friction", &said);
        }
        for wall in &self.walls {
            page.entry(
                "wall",
                &format!(
                    "{}: gap {} m, approached at {} m/s",
                    wall.name,
                    figure(wall.gap),
                    figure(-wall.approach)
                ),
            );
            if let Some(impact) = &wall.impact {
                page.entry(
                    "",
                    &format!(
                        "struck: impulse {} N s, {} J lost; rates after:",
                        figure(impact.impulse),
                        figure(impact.energy_lost)
                    ),
                );
                let rows: Vec<Vec<String>> = self
                    .bodies
                    .iter()
                    .zip(&impact.omega)
                    .map(|((name, _), &omega)| row(name, &[omega]))
                    .collect();
                page.table(&["body", "omega [rad/s]"], &rows);
            }
        }
        page.into_text()
    }

    /// Constraints and motors, those of angles and those of lengths in tables of their own.
    fn describe_constraints(&self, page: &mut Page) {
        for (unit, heads, head_of_motors) in [
            (
                "rad",
                ["name", "multiplier [N m]", "C [rad]", "C' [rad/s]", "torque on"],
                ["name", "torque [N m]", "power [W]", "on"],
            ),
            (
                "m",
                ["name", "multiplier [N]", "C [m]", "C' [m/s]", "force on"],
                ["name", "force [N]", "power [W]", "on"],
            ),
        ] {
            let cells = |name: &str, values: &[f64], on: &str| -> Vec<String> {
                std::iter::once(name.to_owned())
                    .chain(values.iter().map(|&x| figure(x)))
                    .chain([on.to_owned()])
                    .collect()
            };
            let here = |name: &str| self.reaction(name).filter(|reaction| reaction.unit == unit);
            let rows: Vec<Vec<String>> = (self.constraints.iter().zip(&self.reactions))
                .filter(|(_, reaction)| reaction.unit == unit)
                .map(|((name, values), reaction)| cells(name, values, &reaction.on))
                .collect();
            if !rows.is_empty() {
                page.entry("constraints", if unit == "rad" { "of angles" } else { "of places" });
                page.table(&heads, &rows);
            }
            let rows: Vec<Vec<String>> = self
                .motors
                .iter()
                .filter_map(|(name, values)| Some(cells(name, values, &here(name)?.on)))
                .collect();
            if !rows.is_empty() {
                page.entry("motors", "");
                page.table(&head_of_motors, &rows);
            }
        }
    }

    /// Which forces and torques redundant constraints leave open.
    fn describe_open(&self, page: &mut Page) {
        let known = self.hinges.iter().map(|hinge| (&hinge.name, hinge.is_determinate));
        let rows = self
            .constraints
            .iter()
            .zip(&self.reactions)
            .map(|((name, _), reaction)| (name, reaction.is_determinate));
        let all: Vec<(&String, Option<bool>)> = known.chain(rows).collect();
        let open: Vec<&str> =
            all.iter().filter(|(_, known)| *known == Some(false)).map(|(name, _)| name.as_str()).collect();
        if self.is_singular {
            let text = "accelerations, and what constraints exert: at a singular position they are limits \
                along the motion, which the state alone does not tell; run it from before, with outputs";
            page.entry("indeterminate", text);
        } else if !open.is_empty() {
            let text = format!(
                "{}: constraints are redundant here, and rigid bodies do not tell how these joints share the \
                    load; shown are the forces of least norm",
                open.join(", ")
            );
            page.entry("indeterminate", &text);
        } else if all.iter().any(|(_, known)| known.is_none()) {
            page.entry(
                "indeterminate",
                "some forces may be: constraints are redundant, and too many to tell which forces that \
                    leaves open",
            );
        }
    }

    /// What the constraint of that name exerts.
    pub(super) fn reaction(&self, name: &str) -> Option<&Reaction> {
        self.constraints.iter().position(|(known, _)| known == name).and_then(|r| self.reactions.get(r))
    }
}
