//! Motors and laws of time.

use super::*;

/// A motor.
pub(in crate::scene) static MOTOR: Table = Table {
    title: "a motor",
    about: "The angle of a bar, absolute or relative to another bar, as a function of time.",
    fields: &[
        required(
            "name",
            Shape::Name,
            "\"motor\"",
            "Name, unique among motors; it also names the constraint.",
        ),
        required("body", Shape::Body { ground: false }, "\"bar1\"", "The driven bar."),
        optional("relative_to", Shape::Body { ground: true }, "\"bar2\"", MEASURED_FROM),
        required(
            "law",
            Shape::Law(&LAW, ANGLE),
            "{\"start\": 0, \"rate\": 1}",
            "The angle as a function of time.",
        ),
    ],
};

/// A motor on a slider.
pub(in crate::scene) static DRIVE: Table = Table {
    title: "a motor on a slider",
    about: "The travel of a slider along its rail as a function of time.",
    fields: &[
        required(
            "name",
            Shape::Name,
            "\"motor\"",
            "Name, unique among motors; it also names the constraint.",
        ),
        required("slider", Shape::SliderName, "\"slider\"", "The driven slider."),
        required(
            "law",
            Shape::Law(&TRAVEL_LAW, signed("m")),
            "{\"start\": 0, \"rate\": 0.1}",
            "The travel as a function of time.",
        ),
    ],
};

/// The law of a wall.
pub(in crate::scene) static WALL_LAW: Table =
    Table { title: "a law of a wall", about: SUM, fields: &TRAVEL_TERMS };

/// The law of a motor.
pub(in crate::scene) static LAW: Table = Table { title: "a law", about: SUM, fields: &ANGLE_TERMS };

/// The law of a motor on a slider.
pub(in crate::scene) static TRAVEL_LAW: Table =
    Table { title: "a law of travel", about: SUM, fields: &TRAVEL_TERMS };

/// The law of a force or a torque.
pub(in crate::scene) static FACTOR_LAW: Table =
    Table { title: "a law without unit", about: SUM, fields: &FACTOR_TERMS };

const SUM: &str = "start + rate·t + acceleration·t²/2 + the sum of amplitude·sin(frequency·t + phase).";

static ANGLE_TERMS: [Field; 4] = terms(
    required("start", Shape::Number(ANGLE), "1.5707963267948966", "Angle at t = 0 without the sines."),
    [RATE, signed("rad/s²")],
    &[&SINE],
);

static TRAVEL_TERMS: [Field; 4] = terms(
    required("start", Shape::Number(signed("m")), "0.1", "Travel at t = 0 without the sines."),
    [signed("m/s"), signed("m/s²")],
    &[&TRAVEL_SINE],
);

static FACTOR_TERMS: [Field; 4] = terms(
    required("start", Shape::Number(signed("")), "1", "Factor at t = 0 without the sines."),
    [signed("1/s"), signed("1/s²")],
    &[&FACTOR_SINE],
);

const fn terms(
    start: Field,
    [rate, acceleration]: [Quantity; 2],
    sine: &'static [&'static Table],
) -> [Field; 4] {
    [
        start,
        optional("rate", Shape::Number(rate), "3", "Rate; 0 if absent."),
        optional("acceleration", Shape::Number(acceleration), "0.5", "Acceleration; 0 if absent."),
        optional("sines", any_number_of(sine), "[…]", "Sines on top; none if absent."),
    ]
}

/// One sine of a motor's law.
pub(in crate::scene) static SINE: Table = Table { title: "a sine", about: WAVE, fields: &ANGLE_WAVE };

static TRAVEL_SINE: Table = Table { title: "a sine", about: WAVE, fields: &TRAVEL_WAVE };

static FACTOR_SINE: Table = Table { title: "a sine", about: WAVE, fields: &FACTOR_WAVE };

const WAVE: &str = "amplitude·sin(frequency·t + phase).";

static ANGLE_WAVE: [Field; 3] = wave(ANGLE);

static TRAVEL_WAVE: [Field; 3] = wave(signed("m"));

static FACTOR_WAVE: [Field; 3] = wave(signed(""));

const fn wave(amplitude: Quantity) -> [Field; 3] {
    [
        required("amplitude", Shape::Number(amplitude), "0.2", "Amplitude."),
        required("frequency", Shape::Number(RATE), "5", "Angular frequency."),
        optional("phase", Shape::Number(ANGLE), "0", "Phase at t = 0; 0 if absent."),
    ]
}
