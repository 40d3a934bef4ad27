//! Which methods go with which scenes and stabilizations, and why the others do not.

use super::{MANY_COORDINATES, Request, RequestRefusal, mismatch, usage};
use crate::arithmetic::shown::{about, estimate};
use crate::dynamics::Mechanism;
use crate::dynamics::compile::DENSE_LIMIT;
use crate::dynamics::force::Vibration;
use crate::dynamics::natural::{Natural, NaturalError};
use crate::run::methods::{METHODS, MethodId, Stabilization};

/// How much faster than all else a vibration must be to be taken for its mean force: a turn of it within a
/// hundredth of theirs.
const SEPARATE: f64 = 100.0;

/// The stabilization of a pairing, or why there is none.
pub(super) fn pair(
    mechanism: &Mechanism,
    method: MethodId,
    request: &Request,
    notes: &mut Vec<String>,
) -> Result<Stabilization, RequestRefusal> {
    check_size(mechanism, method, request)?;
    check_walls(mechanism, method)?;
    check_friction(mechanism, method, request)?;
    check_aims(mechanism, method, request)?;
    check_rattle(mechanism, method)?;
    if mechanism.constraints.is_empty() {
        if request.stabilize.is_some_and(|kind| kind != Stabilization::None) {
            notes.push("the scene has no constraint: nothing to stabilize".into());
        }
        return Ok(Stabilization::None);
    }
    let Some(asked) = request.stabilize else { return Ok(unasked(mechanism, method, notes)) };
    match against(mechanism, method, asked) {
        None => Ok(asked),
        Some((reason, alternative)) => {
            Err(mismatch(format!("{method} with --stabilize {asked}"), reason, alternative))
        }
    }
}

/// How constraints are kept where nobody says, with a note where they are not.
fn unasked(mechanism: &Mechanism, method: MethodId, notes: &mut Vec<String>) -> Stabilization {
    let own = match method {
        MethodId::Rattle(_) => return Stabilization::Projection,
        MethodId::Dopri5 => "dp5",
        MethodId::Dop853 => "dp8",
        _ => return usual(mechanism),
    };
    let usual = usual(mechanism);
    if usual != Stabilization::Projection {
        return usual;
    }
    notes.push(format!(
        "{method} takes no projection: constraints drift with its tolerance; {own} keeps them"
    ));
    Stabilization::None
}

/// Why a method does not take a stabilization, and what to ask for instead.
fn against(
    mechanism: &Mechanism,
    method: MethodId,
    asked: Stabilization,
) -> Option<(&'static str, &'static str)> {
    use Stabilization::{Baumgarte, Elimination, None as Unkept, Projection};
    if asked == Elimination && mechanism.has_multipliers() {
        let reason = if mechanism.has_closed_loops() {
            "closed loops and sliders have no independent coordinates to be left with"
        } else if mechanism.constraints.iter().any(|row| mechanism.may_be_off(&row.name)) {
            "an event switches a motor off, whose angle is a coordinate from then on"
        } else {
            "a torsion spring counts the turns of an angle, which elimination takes modulo whole ones"
        };
        return Some((reason, "--stabilize projection"));
    }
    let is_projected = usual(mechanism) == Projection;
    let by_own_loop = "projection acts after every accepted step, and ode_solvers owns its loop";
    match (method, asked) {
        (MethodId::Rattle(_), Unkept | Baumgarte | Elimination) => Some((
            "RATTLE keeps every row at both levels by its own projection",
            "leave --stabilize out, or --method dp8",
        )),
        (MethodId::Gauss(_), Unkept | Baumgarte) if is_projected => Some((
            "a Gauss method keeps loops and sliders by symmetric projection, and nothing else keeps its \
                energy",
            "--stabilize projection, or --method dp8",
        )),
        (MethodId::Gauss(_), Unkept | Baumgarte | Projection) if !is_projected => Some((
            "Gauss methods are symplectic in coordinates and momenta, where a motor's angle is eliminated",
            "--stabilize elimination, or --method dp8",
        )),
        (MethodId::Taylor, Baumgarte) => Some((
            "the series is that of the constrained motion, which has nothing to be pulled back from",
            "--stabilize projection or elimination, or --method dp8",
        )),
        (MethodId::Dopri5, Projection) => {
            Some((by_own_loop, "--method dp5, the same tableau in our own stepper"))
        }
        (MethodId::Dop853, Projection) => {
            Some((by_own_loop, "--method dp8, the same tableau in our own stepper"))
        }
        _ => None,
    }
}

/// Walls take methods that end their steps at impacts.
fn check_walls(mechanism: &Mechanism, method: MethodId) -> Result<(), RequestRefusal> {
    let reason = match method {
        _ if mechanism.contacts.is_empty() => return Ok(()),
        MethodId::Dp5 | MethodId::Dp8 | MethodId::Taylor | MethodId::Radau(_) => return Ok(()),
        MethodId::Dopri5 | MethodId::Dop853 => {
            "ode_solvers does not let an impact be located inside its steps"
        }
        _ => "an impact inside a fixed step cannot be located without changing the step",
    };
    Err(mismatch(
        format!("{method} on a scene with walls"),
        reason,
        "--method dp8, taylor for more digits, or dp5 at loose tolerances",
    ))
}

/// Aims that depend on the mechanism ask for all its angles.
fn check_aims(mechanism: &Mechanism, method: MethodId, request: &Request) -> Result<(), RequestRefusal> {
    let aimed = mechanism.constraints.iter().find(|row| row.aim.is_some());
    match (method, aimed, request.stabilize) {
        (MethodId::Taylor, Some(row), Some(Stabilization::Elimination)) => Err(mismatch(
            format!("taylor by elimination on a scene with motor {}", row.name),
            "its aim depends on where the mechanism is, and its series asks for all angles",
            "--stabilize projection",
        )),
        _ => Ok(()),
    }
}

/// RATTLE takes potentials, and what its coordinates can hold.
fn check_rattle(mechanism: &Mechanism, method: MethodId) -> Result<(), RequestRefusal> {
    if !matches!(method, MethodId::Rattle(_)) {
        return Ok(());
    }
    if mechanism.is_damped() {
        let by_rates = mechanism.forces.iter().find(|force| force.depends_on_rates());
        let what = by_rates.map_or("dampers".to_owned(), |force| format!("force or torque {}", force.name));
        return Err(mismatch(
            format!("{method} on a scene with {what}"),
            "RATTLE takes potentials and constant forces, and what depends on rates is neither",
            "--method dop853, or gauss16 for a fixed step",
        ));
    }
    let on_branches = match mechanism.law_without_potential() {
        Some(name) => Err(NaturalError::WithoutPotential(name.to_owned())),
        None => Natural::new(std::sync::Arc::new(mechanism.clone())),
    };
    match on_branches {
        Ok(_) => Ok(()),
        Err(error) => Err(mismatch(
            format!("{method} on this scene"),
            &error.to_string(),
            "--method dp8, or gauss16 for a fixed step",
        )),
    }
}

/// Very many coordinates are taken body by body or not at all.
fn check_size(mechanism: &Mechanism, method: MethodId, request: &Request) -> Result<(), RequestRefusal> {
    if mechanism.tree.is_dense() {
        return Ok(());
    }
    let n = mechanism.coordinates();
    let reason =
        format!("its matrices would hold {n} x {n} numbers, and at most {DENSE_LIMIT} coordinates have them");
    let alternative = "--method dop853, or dp8 where constraints are to be kept";
    if !matches!(method, MethodId::Dopri5 | MethodId::Dop853 | MethodId::Dp5 | MethodId::Dp8) {
        return Err(mismatch(format!("{method} on {n} coordinates"), &reason, alternative));
    }
    if !mechanism.contacts.is_empty() {
        return Err(mismatch(
            format!("walls on {n} coordinates"),
            &reason.replace("its", "an impact's"),
            "fewer bodies",
        ));
    }
    if !mechanism.constraints.is_empty() && request.stabilize == Some(Stabilization::Elimination) {
        return Err(mismatch(format!("elimination on {n} coordinates"), &reason, "--stabilize projection"));
    }
    Ok(())
}

/// The mean force of a vibration is known to the explicit methods, and right where the vibration is much
/// faster than all else.
pub(super) fn check_vibration(
    mechanism: &Mechanism,
    method: MethodId,
    rate: f64,
    notes: &mut Vec<String>,
) -> Result<(), RequestRefusal> {
    let Some(Vibration { name, energy, frequency, .. }) = &mechanism.vibration else {
        return match &mechanism.slowest_rod {
            Some((name, frequency)) if *frequency < rate => Err(too_soft(name, *frequency, 1.0, rate)),
            _ => Ok(()),
        };
    };
    if !matches!(
        method,
        MethodId::Dopri5 | MethodId::Dop853 | MethodId::Dp5 | MethodId::Dp8 | MethodId::Radau(_)
    ) {
        let reason = "the mean force of its vibration comes from the mass matrix, of which this method knows \
            no derivative";
        return Err(mismatch(
            format!("{method} with the rigid spring `{name}`"),
            reason,
            "--method dp8, or dop853",
        ));
    }
    if *frequency < SEPARATE * rate {
        return Err(too_soft(name, *frequency, SEPARATE, rate));
    }
    let share = energy / mechanism.energy_scale;
    notes.push(format!(
        "rigid spring {name}: {} J of vibration ({} of the scale) at {} rad/s act on average; its force \
            is a mean",
        about(*energy),
        estimate(share),
        about(*frequency)
    ));
    Ok(())
}

/// A rigid spring that would not vibrate so many times as fast as all else \[rad/s\].
fn too_soft(name: &str, frequency: f64, times: f64, rate: f64) -> RequestRefusal {
    let often = if times > 1.0 { format!("{times} times ") } else { String::new() };
    let reason = format!(
        "it vibrates at {} rad/s, not {often}as fast as all else, up to {} rad/s",
        about(frequency),
        about(rate)
    );
    mismatch(
        format!("the rigid spring `{name}`"),
        &reason,
        "leave its `model` out: it is soft enough to be resolved",
    )
}

/// Dry friction asks for the forces of joints.
pub(in crate::run) fn check_forces_of_joints(mechanism: &Mechanism) -> Result<(), RequestRefusal> {
    let Some(friction) = mechanism.frictions.first().filter(|_| !mechanism.redundant().is_empty()) else {
        return Ok(());
    };
    let what = format!("dry friction ({} {}) here", friction.kind(), friction.name);
    let reason = "constraints are redundant, so that the forces in the joints, and friction with them, are \
        not determined";
    Err(mismatch(what, reason, "leave out a constraint that others imply already"))
}

/// Collocation is there with some numbers of stages only.
pub(super) fn check_method(request: &Request) -> Result<(), RequestRefusal> {
    let is_there =
        |method: MethodId| method == MethodId::Custom || METHODS.iter().any(|known| known.id == method);
    let Some(method) = request.method.filter(|&method| !is_there(method)) else { return Ok(()) };
    let known: Vec<String> = METHODS.iter().map(|known| format!("{:?}", known.id)).collect();
    let alternative = "radau with 3 or 5 stages, or gauss with 2 to 8";
    Err(usage(&format!("{method:?}"), format!("the methods are {}", known.join(", ")), alternative))
}

/// Dry friction takes methods that end their steps at its transitions and keep by projection what sticks.
fn check_friction(mechanism: &Mechanism, method: MethodId, request: &Request) -> Result<(), RequestRefusal> {
    let Some(friction) = mechanism.frictions.first() else { return Ok(()) };
    let place = || format!("dry friction ({} {})", friction.kind(), friction.name);
    if !matches!(
        method,
        MethodId::Taylor | MethodId::Dp5 | MethodId::Dp8 | MethodId::Radau(_) | MethodId::Custom
    ) {
        let reason = match method {
            MethodId::Dopri5 | MethodId::Dop853 => {
                "ode_solvers does not let what sticks be kept by projection"
            }
            _ => "a transition inside a fixed step cannot be located without changing the step",
        };
        let alternative = "--method dp8, dp5 at loose tolerances, or radau9 where it is stiff";
        return Err(mismatch(format!("{method} on a scene with {}", place()), reason, alternative));
    }
    if matches!(request.stabilize, Some(Stabilization::Baumgarte | Stabilization::Elimination)) {
        let reason = "friction follows from the multipliers, which this one changes or leaves out";
        return Err(mismatch(format!("{} with it", place()), reason, "--stabilize projection"));
    }
    check_forces_of_joints(mechanism)?;
    if !mechanism.tree.is_dense() {
        let reason = format!("it takes matrices, and at most {DENSE_LIMIT} coordinates have them");
        return Err(mismatch(format!("{} here", place()), &reason, "fewer bodies"));
    }
    Ok(())
}

/// How the rows of a mechanism are kept where nobody says: given angles are eliminated where they are all
/// there is to keep.
pub(in crate::run) fn usual(mechanism: &Mechanism) -> Stabilization {
    let is_large = mechanism.coordinates() > MANY_COORDINATES;
    if mechanism.has_multipliers() || is_large || !mechanism.frictions.is_empty() {
        Stabilization::Projection
    } else {
        Stabilization::Elimination
    }
}
