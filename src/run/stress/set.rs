//! The shipped set of stiff and extreme scenes, and where each ends.
//!
//! Ends were computed with 113 bits by two orders of a power series that agree to 1e-16, from the very
//! doubles of the scene files, or by the series with its first orders in double-double, checked by `dp8` to
//! 1e-10 and better.  Those at stiffness 1e12 are of the spring at rest, 4e-12 away from the true motion, and
//! that of the parallelogram is of its one degree of freedom.

use super::{Case, Expected};

/// One scene: its name, its text, the tolerance of its end, and what is expected of it.
struct StressScene(&'static str, &'static str, f64, ExpectedEnd);

/// What is expected, as constants.
enum ExpectedEnd {
    /// Angles \[rad\] and, unless they say too little where vibrations are fast, rates \[rad/s\] of the last
    /// bodies.
    At(&'static [f64], &'static [f64]),
    Energy,
    Refusal,
    Stop(&'static str),
}

use ExpectedEnd::{At, Energy, Refusal, Stop};

macro_rules! entry {
    ($name:literal, $tolerance:literal, $end:expr) => {
        StressScene(
            $name,
            include_str!(concat!("../../../examples/stress/", $name, ".json")),
            $tolerance,
            $end,
        )
    };
}

/// The cases, in the order of the chart.
pub fn shipped() -> Vec<Case> {
    let expected = |end: &ExpectedEnd| match end {
        At(angles, rates) => Expected::End { angles: angles.to_vec(), rates: rates.to_vec() },
        Energy => Expected::Energy,
        Refusal => Expected::Refusal,
        Stop(culprit) => Expected::Stop((*culprit).to_owned()),
    };
    let case = |StressScene(name, text, tolerance, end): &StressScene| Case {
        name: (*name).to_owned(),
        origin: format!("examples/stress/{name}.json"),
        text: (*text).to_owned(),
        tolerance: *tolerance,
        expected: expected(end),
    };
    SET.iter().map(case).collect()
}

// Ends are numbers as they came out, whatever else they may be near.
#[allow(clippy::approx_constant)]
#[rustfmt::skip]
static SET: &[StressScene] = &[
    // Springs from soft to stiff beyond use, released from exactly their free length.
    entry!("spring_1", 0.0001,
        At(&[-0.392611931592605, 1.0762883660857], &[3.78668013182681, 7.97699819661741])),
    entry!("spring_1e2", 0.0001,
        At(&[1.946019497863276, -0.8661466338309817], &[-0.2994350385162033, 5.243985102425289])),
    entry!("spring_1e4", 0.0001,
        At(&[1.95510450394041, -0.817385613970845], &[-0.0267617107153523, 5.75079011960739])),
    entry!("spring_1e6", 0.0001, At(&[1.9551926976824137, -0.8169142969148883], &[])),
    entry!("spring_1e8", 0.0001, At(&[1.95519309603616, -0.816910255945905], &[])),
    entry!("spring_1e10", 0.0001, At(&[1.9551931012568726, 1.4484449470122305], &[])),
    entry!("spring_1e12", 0.0001, At(&[1.95519310129054, -0.816910213412392], &[])),
    // The same with a damper beside them.
    entry!("spring_damped_1e2", 0.0001,
        At(&[1.9485794553048879, -0.8544662632580996], &[-0.060844369143206144, 5.594272100056349])),
    entry!("spring_damped_1e4", 0.0001,
        At(&[1.95511613966919, -0.817363854844559], &[-0.000721351944509091, 5.78719418763749])),
    entry!("spring_damped_1e6", 0.0001,
        At(&[1.9551923251468484, -0.8169148218106886], &[-7.269809983458327e-06, 5.789229053993258])),
    entry!("spring_damped_1e8", 0.0001,
        At(&[1.95519309352313, -0.816910259568464], &[-7.274967776876e-08, 5.78924947979239])),
    entry!("spring_damped_1e10", 0.0001,
        At(&[1.9551931012128558, -0.8169102138740353], &[-7.275478958673458e-10, 5.789249684127057])),
    entry!("spring_damped_1e12", 0.0001, At(&[1.95519310129054, -0.816910213412392], &[])),
    entry!("spring_overdamped", 0.0001,
        At(&[1.57025959897675, -0.816185285177676], &[-0.000803989894191429, 5.78831618540318])),
    // Fast vibrations that carry energy, resolved or averaged.
    entry!("spring_excited_1e6", 0.0001, At(&[1.95578678738958, -1.21015389250257], &[])),
    entry!("spring_rigid_1e8", 0.001, At(&[1.9551555253576625, 1.071851262201026], &[])),
    // The published stiff double pendulum.
    entry!("stiff_pendulum_C0", 0.0001,
        At(&[-1.235876183167118, -11.934317423359907], &[3.00602197036429, 0.5703591214052629])),
    entry!("stiff_pendulum_C8", 0.0001,
        At(&[0.6109714250989311, 0.22652185966794985], &[0.9767395064286652, 4.512642515228173])),
    entry!("stiff_pendulum_C32", 0.0001,
        At(&[0.37768710755788115, 0.43843604072867426], &[-0.4460437202437038, 6.682447102288084])),
    entry!("stiff_pendulum_C64", 0.0001,
        At(&[0.3767499754883, 0.431891520004729], &[1.32220412587949, 4.0417614907693])),
    entry!("stiff_pendulum_C128", 0.001, At(&[0.39160677967001367, 0.40758985326740793], &[])),
    entry!("stiff_pendulum_C512", 0.001, At(&[-0.48216931259059714, -0.4755371201648076], &[])),
    entry!("stiff_pendulum_C2048", 0.001, At(&[-0.4785284996380748, -0.4809963053189357], &[])),
    // Ratios of masses and lengths.
    entry!("mass_ratio_1e-6", 0.0001,
        At(&[-0.83012847432696, -19.5305759591923], &[-5.74810265653879, 2.44491663869115])),
    entry!("mass_ratio_1e6", 0.001,
        At(&[1.01636066419663, 1.39353894665367], &[2.97797139837053, 2.98298948201023])),
    entry!("length_ratio_1e-3", 0.001,
        At(&[0.910403571233251, 6.54377275827336], &[-4.84796532386241, 332.40525917587])),
    entry!("length_ratio_1e3", 0.0001,
        At(&[1.62636771773247, 1.52160779253517], &[-1.75533234959776, -0.0463516153807027])),
    entry!("chain5_taper", 0.0001,
        At(&[-1.1363777302353, -5.55269610598696, -3.85373753071388, -4.86622400741109, -5.70020134450882],
            &[2.7658729863879, -10.5898898567666, -5.77752809506406, -4.96973518158059, 8.15919019874247])),
    // Motors.
    entry!("motor_1e-3", 0.0001, At(&[-0.776690640202119], &[5.90962271640294])),
    entry!("motor_1", 0.0001, At(&[-0.30533017665760304], &[6.7531151884171114])),
    entry!("motor_1e2", 0.001, At(&[101.36834966743169], &[71.50523974169495])),
    entry!("motor_1e3", 0.001, At(&[1001.40954897459], &[1308.20824599595])),
    entry!("motor_1e4", 0.001, At(&[1001.41018613167], &[13085.7043581898])),
    entry!("motor_from_rest", 0.0001, Refusal),
    entry!("kapitza_stable", 0.0001, At(&[2.99143139161646], &[-0.288059732232045])),
    entry!("kapitza_falls", 0.0001, At(&[-3.02980022857548], &[-0.210639529579102])),
    // Unstable equilibria and symmetric releases.
    entry!("inverted_exact", 1e-06,
        At(&[3.14159265276262, 3.14159265532319], &[-7.65928648508362e-09, 1.60516069386245e-08])),
    entry!("inverted_1e-9", 0.05,
        At(&[6.39888461471755, -2.13420416135344], &[10.0736030378231, 9.53398626860123])),
    entry!("top_release", 0.0001,
        At(&[0.4678673953627058, -0.051100623872658554], &[-10.973912242449416, 14.94326696863995])),
    entry!("aligned_horizontal", 0.0001,
        At(&[1.5520204714503412, 1.3666811309264988], &[2.439912136894218, -4.931244867512622])),
    // Gravity and speed.
    entry!("zero_gravity", 0.0001,
        At(&[24.43236154754093, 24.135831665661662], &[4.466970260919468, -4.321673332698999])),
    entry!("rest_zero_gravity", 1e-12, At(&[0.3, -1.2], &[0.0, 0.0])),
    entry!("gravity_1e6", 0.0001,
        At(&[0.2606261602801654, 0.2689060922914833], &[-315.6775916562325, 1273.7434964221454])),
    entry!("whirling", 0.001,
        At(&[99.97714029952435, 99.97697121179154], &[99.95576823670261, 100.04060045263361])),
    entry!("spin_1e3", 0.001,
        At(&[63.7940099047365, 65.1862537859107], &[259.148058318915, 1493.31710788909])),
    // Large angles and long horizons.
    entry!("angle_1e6_turns", 0.0001,
        At(&[6283185.61005905, 0.242261296934515], &[0.125787284347423, -2.29219899413964])),
    entry!("angle_1e9_turns", 0.0001,
        At(&[6283185307.17643, 0.1673503657326578], &[-0.37882078093306315, 0.38444692894969934])),
    entry!("angle_1e15", 0.0001, Refusal),
    entry!("steps_1e7", 0.0001, Energy),
    // Near singular positions and through them.
    entry!("fourbar_1e-2", 0.0001,
        At(&[1.70005646925254, 1.22074704951038, 4.14311537308163],
            &[-3.37017502025112, 4.98302937855898, 6.91616391740186])),
    entry!("fourbar_1e-4", 0.01,
        At(&[2.02891609178612, 0.807818126842522, 3.49099213571716],
            &[-3.37748197769137, 3.79356900220357, 7.16788046547722])),
    entry!("fourbar_exact", 0.0001,
        At(&[-1.3368169080059875, 1.5707963267948966, 1.8047757455838056],
            &[4.937417308039714, 0.0, 4.937417308039714])),
    entry!("slider_crank_lock", 0.001,
        At(&[7.914726088872287, -1.5068484565551696], &[9.364212705180162, 8.89393382897317])),
    entry!("spring_near_zero_length", 0.001,
        At(&[-0.297398863179405, -2.29752587200947], &[-0.865683405160908, -4.89382675302942])),
    entry!("spring_zero_length", 0.0001, Stop("spring")),
    // What has no equations of motion.
    entry!("massless_bar", 0.0001, Refusal),
    entry!("two_motors", 0.0001, Refusal),
    entry!("spring_stiffness_infinite", 0.0001, Refusal),
];
