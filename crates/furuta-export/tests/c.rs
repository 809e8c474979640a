//! The exported C file against the control system it was made from: the same bits, sample by sample.

#[path = "../../furuta-wire/tests/common/compiled.rs"]
mod compiled;

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use furuta_ctrl::estimators::Measurement;
use furuta_ctrl::supervisor::{Fault, Mode, Request, Supervisor, SupervisorState};
use furuta_ctrl::{Config, ControllerFile, Real, Site};
use furuta_export::c::{CONTROLLERS, ESTIMATORS, ExportError, Precision, controller};
use furuta_model::{Effect, Plant, Rig, State};

const PERIOD: f64 = 0.002;
const SAMPLES: usize = 6000;

/// What stands for a number on the way to C and back.
trait Bits: Real {
    const PRECISION: Precision;
    fn bits(self) -> u64;
}

impl Bits for f64 {
    const PRECISION: Precision = Precision::Double;
    fn bits(self) -> u64 {
        self.to_bits()
    }
}

impl Bits for f32 {
    const PRECISION: Precision = Precision::Single;
    fn bits(self) -> u64 {
        u64::from(self.to_bits())
    }
}

/// As `tests/c/main.c` prints it.
fn shown<T: Bits>(number: T) -> String {
    if number.value().is_nan() {
        "nan".to_owned()
    } else {
        format!("{:x}", number.bits())
    }
}

struct Random(u64);

impl Random {
    /// In -1..1.
    fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

/// A folder that goes when the test ends.
struct Folder(PathBuf);

impl Folder {
    fn new() -> Self {
        let name = std::thread::current()
            .name()
            .unwrap_or("main")
            .replace(':', "-");
        let path =
            std::env::temp_dir().join(format!("furuta-export-{}-{name}", std::process::id()));
        std::fs::create_dir_all(&path).expect("a folder for the program");
        Self(path)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

const STRICT: [&str; 6] = [
    "-std=c99",
    "-Wall",
    "-Wextra",
    "-Werror",
    "-pedantic",
    "-ffp-contract=off",
];

/// Whether this compiler is there.
fn is_there(compiler: &str) -> bool {
    let asked = Command::new(compiler).arg("--version").output();
    if asked.is_err() {
        eprintln!("skipped: no {compiler}");
    }
    asked.is_ok()
}

/// A loop of the rig and the Rust controller; every line that C is asked, and what it must answer.
struct Told {
    input: String,
    answers: Vec<String>,
    modes: Vec<Mode>,
}

/// A rig that differs from its file, with noise, pushes, lost samples, readings that are no numbers, stops and resets.
fn told<T: Bits>(supervisor: &Supervisor<T>, rig: &Rig, seed: u64) -> Told {
    let mut params = rig.params;
    params.pendulum.mass *= 1.03;
    let friction = 0.01 * params.coefficients().drive * params.motor.command_limit;
    let friction = Effect::new("arm.coulomb", &[friction]).expect("possible");
    let plant = Plant::<f64>::new(&params, &[friction]).expect("possible");
    let mut s = plant.rest(State::new(0.1, std::f64::consts::PI, 0.0, 0.0));
    let mut random = Random(seed);
    let mut state = supervisor.start();
    let (mut input, mut answers, mut modes) = (String::new(), Vec::new(), Vec::new());
    let mut held = 0.0;
    for k in 0..SAMPLES {
        let mut ask = |state: &mut SupervisorState<T>, request: Request| {
            let number = [Request::Start, Request::Stop, Request::Reset]
                .iter()
                .position(|r| *r == request);
            let _ = writeln!(input, "a {}", number.expect("one of three"));
            answers.push(i32::from(state.request(request)).to_string());
        };
        match k % 3000 {
            20 => ask(&mut state, Request::Start),
            2200 => ask(&mut state, Request::Stop),
            2700 | 1700 | 1400 => {
                ask(&mut state, Request::Reset);
                ask(&mut state, Request::Start);
            }
            _ => {}
        }
        if k % 700 == 650 {
            s.x.alpha_dot += 6.0 * random.next();
        }
        let periods = if k % 97 == 96 { 3 } else { 1 };
        for _ in 0..periods {
            plant.step(&mut s, held, PERIOD);
        }
        let [theta, alpha] = rig.sensors.quantised([
            s.x.theta + 1e-3 * random.next(),
            s.x.alpha + 1e-3 * random.next(),
        ]);
        // An encoder that jumps: the arm beyond its limit. A reading that is none.
        let theta = if (1650..1660).contains(&k) {
            theta + 7.0
        } else {
            theta
        };
        let alpha = if k == 4300 { f64::NAN } else { alpha };
        let target = if k % 3000 < 1000 { 0.0 } else { 0.5 };
        let [t, a, u, r] = [theta, alpha, held, target].map(T::from_f64);
        let measurement = Measurement {
            theta: t,
            alpha: a,
            held: u,
            periods,
        };
        let out = supervisor.update(&mut state, &measurement, r);
        let _ = writeln!(
            input,
            "s {:x} {:x} {:x} {periods} {:x}",
            t.bits(),
            a.bits(),
            u.bits(),
            r.bits()
        );
        let fault = match state.fault() {
            None => 0,
            Some(Fault::NotANumber) => 1,
            Some(Fault::ArmAngle { .. }) => 2,
            Some(Fault::ArmSpeed { .. }) => 3,
            Some(_) => 4,
        };
        let mut line = format!("{} {fault} {}", out.mode as u32, shown(out.u));
        for x in out.x.to_array() {
            let _ = write!(line, " {}", shown(x));
        }
        let _ = write!(line, " {}", shown(out.reference));
        answers.push(line);
        modes.push(out.mode);
        held = out.u.value();
    }
    Told {
        input,
        answers,
        modes,
    }
}

/// The C program's lines.
fn asked(folder: &Path, text: &str, input: &str, precision: Precision) -> Vec<String> {
    std::fs::write(folder.join("furuta_controller.c"), text).expect("written");
    let include = format!("-I{}", folder.display());
    let mut options = [&STRICT[..], &["-O2", &include]].concat();
    if precision == Precision::Single {
        options.push("-DSINGLE");
    }
    let source = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/c/main.c");
    let answer = compiled::answer("gcc", &options, source, input).expect("gcc is there");
    answer.lines().map(str::to_owned).collect()
}

/// Both in lockstep; the modes that were passed through.
fn same_bits<T: Bits>(folder: &Path, config: &Config, rig: &Rig, seed: u64) -> Vec<Mode> {
    let text = controller(config, rig, PERIOD, T::PRECISION).expect("can be exported");
    let supervisor = Supervisor::<T>::design(config, &Site::of(rig, PERIOD)).expect("possible");
    let told = told(&supervisor, rig, seed);
    let answers = asked(folder, &text, &told.input, T::PRECISION);
    assert_eq!(answers.len(), told.answers.len());
    for (k, (c, rust)) in answers.iter().zip(&told.answers).enumerate() {
        assert_eq!(
            c,
            rust,
            "line {k} of {}, {} with {}",
            rig.name,
            config.controller.spec().id,
            config.estimator.spec().id
        );
    }
    told.modes
}

fn config(text: &str) -> Config {
    ControllerFile::from_toml(text)
        .expect("a controller file")
        .config
}

#[test]
fn every_builtin_rig_in_both_precisions() {
    if !is_there("gcc") {
        return;
    }
    let folder = Folder::new();
    let mut modes = Vec::new();
    for (seed, name) in (1..).zip(Rig::VOLTAGE) {
        let rig = Rig::builtin(name).expect("built in");
        modes.extend(same_bits::<f64>(&folder.0, &Config::default(), &rig, seed));
        modes.extend(same_bits::<f32>(
            &folder.0,
            &Config::default(),
            &rig,
            seed + 10,
        ));
    }
    // The comparison has been everywhere.
    for mode in [
        Mode::Idle,
        Mode::SwingUp,
        Mode::Balance,
        Mode::Stopping,
        Mode::Braking,
        Mode::Fault,
    ] {
        assert!(modes.contains(&mode), "never {mode:?}");
    }
}

#[test]
fn every_kind_of_controller_and_estimator() {
    if !is_there("gcc") {
        return;
    }
    let folder = Folder::new();
    let rig = Rig::builtin("shahzad2022-srv02").expect("built in");
    let mut files: Vec<String> = Vec::new();
    for kind in CONTROLLERS {
        files.push(format!("[controller]\nkind = \"{kind}\"\n"));
    }
    for kind in ESTIMATORS {
        files.push(format!("[estimator]\nkind = \"{kind}\"\n"));
    }
    files.push("[controller]\nkind = \"lqr_sliding\"\nreaching = \"super_twisting\"\n".to_owned());
    files.push("[controller]\nkind = \"normal_form_sliding\"\nfilter = 0.01\n".to_owned());
    files.push(
        "[supervisor]\ncatch_error = 0.1\ncatch_every = 3\n[swing_up]\nlearn = 0.0\n".to_owned(),
    );
    for (seed, file) in (1..).zip(&files) {
        let config = config(file);
        let modes = same_bits::<f64>(&folder.0, &config, &rig, seed);
        assert!(modes.contains(&Mode::Balance), "{file}: never caught");
    }
    let single = config(
        "[controller]\nkind = \"normal_form_sliding\"\n[estimator]\nkind = \"disturbance_observer\"\n",
    );
    same_bits::<f32>(&folder.0, &single, &rig, 99);
    // What the inverted model holds of a spring is in the file too.
    let mut sprung = rig.clone();
    let spring = Effect::new("arm.spring", &[0.01, 0.1]).expect("sound");
    sprung.effects.push(spring);
    let inverse = config("[controller]\nkind = \"normal_form_sliding\"\n");
    same_bits::<f64>(&folder.0, &inverse, &sprung, 98);
}

/// Typical sizes, as many at once as a plant holds.
#[test]
fn effects_of_the_rig_file() {
    if !is_there("gcc") {
        return;
    }
    let folder = Folder::new();
    let sets: [&[(&str, &[f64])]; 4] = [
        &[
            ("arm.cable", &[0.004, 0.001, 0.002, 0.1]),
            ("arm.cogging", &[5e-4, 8.0, 0.3]),
            ("arm.quadratic", &[1e-5]),
            ("pendulum.quadratic", &[1e-5]),
            ("pendulum.spring", &[5e-4, 3.0]),
            ("sensor.alpha.offset", &[0.01]),
        ],
        &[
            ("arm.spring", &[0.003, -0.2]),
            ("arm.tilt", &[0.01, 0.5, 0.3]),
            ("motor.ripple", &[0.05, 6.0, 0.2]),
            ("pendulum.bias", &[2e-4]),
            ("pendulum.inertia_transverse", &[1e-5]),
            ("sensor.alpha.scale", &[1.01, 1.0]),
            ("sensor.theta.scale", &[0.99]),
        ],
        &[
            ("motor.deadzone", &[0.15]),
            ("motor.bias", &[0.05]),
            ("motor.saturation", &[8.0]),
            ("motor.asymmetry", &[0.9]),
        ],
        // What an estimator without a model need not know.
        &[
            ("arm.coulomb", &[0.004]),
            ("arm.spring", &[0.003, -0.2]),
            ("motor.deadzone", &[0.15]),
            ("motor.delay", &[0.001]),
            ("motor.lag", &[0.002]),
            ("pendulum.coulomb", &[2e-4]),
        ],
    ];
    for (i, set) in sets.iter().enumerate() {
        let mut rig = Rig::builtin("shahzad2022-srv02").expect("built in");
        rig.effects = set
            .iter()
            .map(|(id, values)| Effect::new(id, values).expect("an effect"))
            .collect();
        let kind = if i == 3 { "derivative" } else { "observer" };
        let config = config(&format!("[estimator]\nkind = \"{kind}\"\n"));
        same_bits::<f64>(&folder.0, &config, &rig, 40 + i as u64);
        same_bits::<f32>(&folder.0, &config, &rig, 50 + i as u64);
    }
}

#[test]
fn what_cannot_be_exported_is_refused() {
    let rig = Rig::builtin("qube-servo-2").expect("built in");
    let export = |file: &str, rig: &Rig| controller(&config(file), rig, PERIOD, Precision::Double);
    let error = export("[controller]\nkind = \"mpc\"\n", &rig).expect_err("no code");
    assert!(matches!(error, ExportError::Controller { kind: "mpc", .. }));
    let message = "[controller] kind = \"mpc\" cannot be exported to C; it can be one of lqr, lqi, output_regulator, \
                   lqr_sliding, normal_form_sliding: give one of these in the controller file";
    assert_eq!(error.to_string(), message);
    let error = export("[estimator]\nkind = \"ekf\"\n", &rig).expect_err("no code");
    assert!(matches!(error, ExportError::Estimator { kind: "ekf", .. }));
    let with = |id: &str, values: &[f64]| {
        let mut rig = rig.clone();
        rig.effects
            .push(Effect::new(id, values).expect("an effect"));
        rig
    };
    let rubbing = with("arm.coulomb", &[1e-3]);
    let error = export("", &rubbing).expect_err("dry friction");
    assert!(matches!(&error, ExportError::EffectInModel { effect, .. } if effect == "arm.coulomb"));
    assert!(error.to_string().contains("give kind = \"derivative\""));
    assert!(export("[estimator]\nkind = \"derivative\"\n", &rubbing).is_ok());
    let error = export(
        "[estimator]\nkind = \"derivative\"\n",
        &with("motor.drift", &[1e-3]),
    )
    .expect_err("a gain that drifts");
    assert!(matches!(&error, ExportError::Effect { effect, .. } if effect == "motor.drift"));
}

/// A name that would end the comment, were it written as it is.
#[test]
fn a_name_cannot_leave_the_comment() {
    let mut rig = Rig::builtin("qube-servo-2").expect("built in");
    rig.name = "*/ #error".to_owned();
    let text = controller(&Config::default(), &rig, PERIOD, Precision::Double).expect("exported");
    assert!(!text.contains("*/ #error"));
}

#[test]
fn the_compiler_for_a_microcontroller_takes_it() {
    let compiler = "arm-none-eabi-gcc";
    if !is_there(compiler) {
        return;
    }
    let folder = Folder::new();
    let rig = Rig::builtin("qube-servo-2").expect("built in");
    for precision in [Precision::Double, Precision::Single] {
        let text = controller(&Config::default(), &rig, PERIOD, precision).expect("exported");
        let source = folder.0.join("furuta_controller.c");
        std::fs::write(&source, text).expect("written");
        let compiled = Command::new(compiler)
            .args(STRICT)
            .args([
                "-O2",
                "-mcpu=cortex-m4",
                "-mthumb",
                "-mfloat-abi=hard",
                "-mfpu=fpv4-sp-d16",
                "-c",
            ])
            .arg(&source)
            .arg("-o")
            .arg(folder.0.join("control.o"))
            .output()
            .expect("it is there");
        assert!(
            compiled.status.success(),
            "{}",
            String::from_utf8_lossy(&compiled.stderr)
        );
    }
}
