//! Motors and laws of time.

use super::*;

/// A motor.
pub(in crate::scene) static MOTOR: KeyTable = KeyTable {
    title: "a motor",
    about: "The angle of a bar, absolute or relative to another bar, as a function of time.",
    fields: &[
        required(
            "name",
            FieldShape::Name,
            "\"motor\"",
            "Name, unique among motors, sliders, locks and rigid springs, whose constraints bear it.",
        ),
        required("body", FieldShape::Body { ground: false }, "\"bar1\"", "The driven bar."),
        optional("relative_to", FieldShape::Body { ground: true }, "\"bar2\"", MEASURED_FROM),
        required(
            "law",
            FieldShape::Law(&LAW, ANGLE),
            "{\"start\": 0, \"rate\": 1}",
            "The angle as a function of time.",
        ),
    ],
};

/// A motor on a slider.
pub(in crate::scene) static DRIVE: KeyTable = KeyTable {
    title: "a motor on a slider",
    about: "The travel of a slider along its rail as a function of time.",
    fields: &[
        required(
            "name",
            FieldShape::Name,
            "\"motor\"",
            "Name, unique among motors, sliders, locks and rigid springs, whose constraints bear it.",
        ),
        required("slider", FieldShape::SliderName, "\"slider\"", "The driven slider."),
        required(
            "law",
            FieldShape::Law(&TRAVEL_LAW, signed("m")),
            "{\"start\": 0, \"rate\": 0.1}",
            "The travel as a function of time.",
        ),
    ],
};

/// The law of a wall.
pub(in crate::scene) static WALL_LAW: KeyTable =
    KeyTable { title: "a law of a wall", about: SUM, fields: &TRAVEL_TERMS };

/// The law of a motor.
pub(in crate::scene) static LAW: KeyTable = KeyTable { title: "a law", about: SUM, fields: &ANGLE_TERMS };

/// The law of a motor on a slider.
pub(in crate::scene) static TRAVEL_LAW: KeyTable =
    KeyTable { title: "a law of travel", about: SUM, fields: &TRAVEL_TERMS };

/// The law of a force or a torque.
pub(in crate::scene) static FACTOR_LAW: KeyTable =
    KeyTable { title: "a law without unit", about: SUM, fields: &FACTOR_TERMS };

const SUM: &str = "start + rate·t + acceleration·t²/2 + the sum of amplitude·sin(frequency·t + phase).";

static ANGLE_TERMS: [Field; 4] = terms(
    required("start", FieldShape::Number(ANGLE), "1.5707963267948966", "Angle at t = 0 without the sines."),
    [RATE, signed("rad/s²")],
    &[&SINE],
);

static TRAVEL_TERMS: [Field; 4] = terms(
    required("start", FieldShape::Number(signed("m")), "0.1", "Travel at t = 0 without the sines."),
    [signed("m/s"), signed("m/s²")],
    &[&TRAVEL_SINE],
);

static FACTOR_TERMS: [Field; 4] = terms(
    required("start", FieldShape::Number(signed("")), "1", "Factor at t = 0 without the sines."),
    [signed("1/s"), signed("1/s²")],
    &[&FACTOR_SINE],
);

const fn terms(
    start: Field,
    [rate, acceleration]: [QuantityRange; 2],
    sine: &'static [&'static KeyTable],
) -> [Field; 4] {
    [
        start,
        optional("rate", FieldShape::Number(rate), "3", "Rate; 0 if absent."),
        optional("acceleration", FieldShape::Number(acceleration), "0.5", "Acceleration; 0 if absent."),
        optional("sines", any_number_of(sine), "[…]", "Sines on top; none if absent."),
    ]
}

/// One sine of a motor's law.
pub(in crate::scene) static SINE: KeyTable = KeyTable { title: "a sine", about: WAVE, fields: &ANGLE_WAVE };

static TRAVEL_SINE: KeyTable = KeyTable { title: "a sine", about: WAVE, fields: &TRAVEL_WAVE };

static FACTOR_SINE: KeyTable = KeyTable { title: "a sine", about: WAVE, fields: &FACTOR_WAVE };

const WAVE: &str = "amplitude·sin(frequency·t + phase).";

static ANGLE_WAVE: [Field; 3] = wave(ANGLE);

static TRAVEL_WAVE: [Field; 3] = wave(signed("m"));

static FACTOR_WAVE: [Field; 3] = wave(signed(""));

const fn wave(amplitude: QuantityRange) -> [Field; 3] {
    [
        required("amplitude", FieldShape::Number(amplitude), "0.2", "Amplitude."),
        required("frequency", FieldShape::Number(RATE), "5", "Angular frequency."),
        optional("phase", FieldShape::Number(ANGLE), "0", "Phase at t = 0; 0 if absent."),
    ]
}
