//! The kinds of things that a scene may hold, for tables of coverage.

/// A kind of part, or a property.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Kind {
    SharedHinge,
    Loop,
    GroundSlider,
    BodySlider,
    LockedSlider,
    Weld,
    Lock,
    RelativeLock,
    FloatingBody,
    FloatingGroup,
    Spring,
    BodySpring,
    ZeroLengthSpring,
    Damper,
    DamperAlone,
    RigidSpring,
    TorsionSpring,
    RelativeTorsionSpring,
    TorsionDamper,
    Force,
    BodyForce,
    ForceLaw,
    Torque,
    RelativeTorque,
    TorqueLaw,
    Motor,
    RelativeMotor,
    SliderMotor,
    SineLaw,
    AcceleratedLaw,
    FullyDriven,
    PlasticWall,
    Wall,
    ElasticWall,
    TouchingWall,
    OffAxis,
    PointMass,
    LightBody,
    NoGravity,
}

impl Kind {
    pub const ALL: [Self; 39] = [
        Self::SharedHinge,
        Self::Loop,
        Self::GroundSlider,
        Self::BodySlider,
        Self::LockedSlider,
        Self::Weld,
        Self::Lock,
        Self::RelativeLock,
        Self::FloatingBody,
        Self::FloatingGroup,
        Self::Spring,
        Self::BodySpring,
        Self::ZeroLengthSpring,
        Self::Damper,
        Self::DamperAlone,
        Self::RigidSpring,
        Self::TorsionSpring,
        Self::RelativeTorsionSpring,
        Self::TorsionDamper,
        Self::Force,
        Self::BodyForce,
        Self::ForceLaw,
        Self::Torque,
        Self::RelativeTorque,
        Self::TorqueLaw,
        Self::Motor,
        Self::RelativeMotor,
        Self::SliderMotor,
        Self::SineLaw,
        Self::AcceleratedLaw,
        Self::FullyDriven,
        Self::PlasticWall,
        Self::Wall,
        Self::ElasticWall,
        Self::TouchingWall,
        Self::OffAxis,
        Self::PointMass,
        Self::LightBody,
        Self::NoGravity,
    ];

    /// Name in tables.
    pub fn name(self) -> String {
        let mut name = String::new();
        for letter in format!("{self:?}").chars() {
            if letter.is_ascii_uppercase() && !name.is_empty() {
                name.push(' ');
            }
            name.push(letter.to_ascii_lowercase());
        }
        name
    }

    /// False for a kind that takes away what the other needs.
    pub fn goes_with(self, other: Self) -> bool {
        let driven = |kind| matches!(kind, Self::FullyDriven);
        let free = |kind| {
            matches!(
                kind,
                Self::FloatingBody
                    | Self::FloatingGroup
                    | Self::PlasticWall
                    | Self::Wall
                    | Self::ElasticWall
                    | Self::TouchingWall
            )
        };
        self != other && !(driven(self) && free(other)) && !(free(self) && driven(other))
    }

    pub fn is_wall(self) -> bool {
        matches!(self, Self::PlasticWall | Self::Wall | Self::ElasticWall | Self::TouchingWall)
    }

    /// True where energy is not kept: it is lost, or motors and laws put it in.
    pub fn is_dissipative_or_driven(self) -> bool {
        use Kind::*;
        matches!(
            self,
            Damper
                | DamperAlone
                | TorsionDamper
                | Force
                | BodyForce
                | ForceLaw
                | Torque
                | RelativeTorque
                | TorqueLaw
                | Motor
                | RelativeMotor
                | SliderMotor
                | FullyDriven
                | PlasticWall
                | Wall
        )
    }
}
