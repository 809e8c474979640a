//! A rig as a model of MuJoCo (MJCF).
//!
//! The arm turns about `z` and lies along `x`; the pendulum's hinge is the arm's `x` axis, its angle 0 upright. The
//! actuator `motor` takes the rig's command: its gain is the torque per volt (ampere, N m), its bias the back-EMF's
//! damping. What of the rig's
//! effects the format can say is in the file, the rest in a comment at its head.

use std::fmt::Write as _;

use crate::body::{Bodies, BodyError, NO_BODY, TRANSVERSE, value};
use crate::remark::{Exported, Remark, comment, name};
use furuta_model::{Actuation, Effect, Rig};

/// Step of the integrator that [`mjcf`] is usually asked for, s.
pub const STEP: f64 = 5e-4;

/// Unit of the command in words.
fn unit(actuation: Actuation) -> &'static str {
    match actuation {
        Actuation::Voltage => "volts",
        other => other.unit(),
    }
}

const NO_MEANS: &str = "MJCF has no means for it";
const COMMAND: &str =
    "MJCF has no such map between command and motor; apply it to the command before data.ctrl";
const READING: &str = "MJCF's sensors show the true angles; apply it to what they show";

/// The rig, its effects included where MJCF can say them, for a simulation in steps of `timestep` (s).
///
/// Carried over: `arm.coulomb` and `pendulum.coulomb` (`frictionloss`), `arm.spring`, `arm.cable` and `pendulum.spring`
/// (stiffness), `arm.quadratic` and `pendulum.quadratic` (damping), `arm.tilt` (gravity), `motor.bias`,
/// `motor.saturation` (range of the control), `motor.lag` (the actuator's dynamics), `pendulum.bias`,
/// `pendulum.inertia_transverse`, `drive.backlash` and `drive.compliance` (a rotor of its own).
///
/// # Errors
/// A rig of which no rigid bodies have the moments of inertia: see [`BodyError`].
///
/// ```
/// let mut rig = furuta_model::Rig::builtin("qube-servo-2").ok_or("no such rig")?;
/// rig.effects.push(furuta_model::Effect::new("arm.coulomb", &[1e-3])?);
/// rig.effects.push(furuta_model::Effect::new("motor.deadzone", &[0.2])?);
/// let exported = furuta_export::mjcf(&rig, furuta_export::mjcf::STEP)?;
/// assert!(exported.text.contains("frictionloss=\"0.001\""));
/// assert!(exported.left_out.iter().any(|remark| remark.what == "motor.deadzone"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn mjcf(rig: &Rig, timestep: f64) -> Result<Exported, BodyError> {
    let bodies = Bodies::of(&rig.params, &rig.effects)?;
    let model = Model::of(rig);
    let mut left_out = model.left_out;
    if bodies.without_effect {
        left_out.push(Remark::new(TRANSVERSE, NO_BODY));
    }
    let (p, k) = (&rig.params, rig.params.coefficients());
    let emf = k.arm_damping - p.arm.viscous;
    let motor_joint = if bodies.rotor > 0.0 { "rotor" } else { "theta" };
    // What is on the motor's side of a drive.
    let shaft = format!(
        "damping=\"{}\" frictionloss=\"{}\" {}",
        polynomial([p.arm.viscous, model.arm_quadratic, 0.0]),
        model.arm_friction,
        friction_law(timestep),
    );
    let (on_arm, rotor) = if bodies.rotor > 0.0 {
        let inertia = bodies.rotor;
        let rotor = format!(
            r#"    <body name="rotor">
      <joint name="rotor" type="hinge" axis="0 0 1" {shaft}/>
      <inertial pos="0 0 0" mass="1" diaginertia="{inertia:?} {inertia:?} {inertia:?}"/>
    </body>
"#
        );
        (String::new(), rotor)
    } else {
        (shaft, String::new())
    };
    let mut out = String::new();
    // Writing to a String cannot fail.
    let _ = write!(
        out,
        r#"<mujoco model="{}">
  <!-- {}
       Written by furuta. SI units, radians; alpha = 0 upright; data.ctrl[0] in {}.
       u is held from one sample to the next; encoders: {} (arm) and {} (pendulum) counts a turn.
"#,
        name(&rig.name),
        comment(&rig.source),
        unit(rig.params.motor.actuation),
        rig.sensors.arm_counts_per_rev,
        rig.sensors.pendulum_counts_per_rev,
    );
    for remark in &left_out {
        let _ = writeln!(out, "       {}", comment(&remark.to_string()));
    }
    let [gx, gy, gz] = model.gravity;
    let (length, com) = (p.arm.length, p.pendulum.com);
    let [hinge, transverse, axial] = bodies.pendulum;
    // The arm's mass counts on a tilted base alone: so large that its centre is all but on the axis.
    let mass = 100.0;
    let off = model.unbalance * p.pendulum.mass * length / mass;
    let arm = bodies.arm - mass * off * off;
    let _ = write!(
        out,
        r#"  -->
  <compiler angle="radian" balanceinertia="false"/>
  <option timestep="{timestep:?}" gravity="{gx:?} {gy:?} {gz:?}" integrator="RK4" cone="elliptic" tolerance="1e-10">
    <flag contact="disable" refsafe="disable"/>
  </option>
  <worldbody>
    <body name="arm">
      <joint name="theta" type="hinge" axis="0 0 1" stiffness="{}" springref="{:?}" {on_arm}/>
      <inertial pos="{off:?} 0 0" mass="{mass}" diaginertia="{arm:?} {arm:?} {arm:?}"/>
      <geom type="capsule" fromto="0 0 0 {length:?} 0 0" size="{:?}" rgba="0.4 0.45 0.5 1"/>
      <body name="pendulum" pos="{length:?} 0 0">
        <joint name="alpha" type="hinge" axis="1 0 0" armature="{:?}" damping="{}" stiffness="{:?}"
               springref="{:?}" frictionloss="{:?}" {}/>
        <inertial pos="0 0 {com:?}" mass="{:?}" diaginertia="{hinge:?} {transverse:?} {axial:?}"/>
        <geom type="capsule" fromto="0 0 0 0 0 {:?}" size="{:?}" rgba="0.8 0.3 0.2 1"/>
      </body>
    </body>
{rotor}  </worldbody>
"#,
        polynomial(model.arm_spring),
        model.arm_rest,
        0.05 * length,
        bodies.armature,
        polynomial([p.pendulum.viscous, model.pendulum_quadratic, 0.0]),
        model.pendulum_spring[0],
        model.pendulum_spring[1],
        model.pendulum_friction,
        friction_law(timestep),
        p.pendulum.mass,
        2.0 * com,
        0.05 * com,
    );
    if let Some(drive) = &model.drive {
        let _ = write!(
            out,
            r#"  <tendon>
    <fixed name="drive" {}>
      <joint joint="rotor" coef="1"/>
      <joint joint="theta" coef="-1"/>
    </fixed>
  </tendon>
"#,
            drive.coupling(timestep)
        );
    }
    let (drive, limit, bias) = (k.drive, p.motor.command_limit, model.motor_bias);
    let low = (-limit).max(-model.saturation - bias);
    let high = limit.min(model.saturation - bias);
    let dynamics = match model.lag {
        0.0 => String::new(),
        lag => format!(" dyntype=\"filter\" dynprm=\"{lag:?}\""),
    };
    let _ = write!(
        out,
        r#"  <actuator>
    <general name="motor" joint="{motor_joint}" ctrllimited="true" ctrlrange="{low:?} {high:?}"{dynamics}
             gaintype="fixed" gainprm="{drive:?}" biastype="affine" biasprm="{:?} 0 {:?}"/>
"#,
        drive * bias,
        -emf,
    );
    if model.pendulum_bias != 0.0 {
        let torque = model.pendulum_bias;
        let _ = writeln!(
            out,
            "    <general name=\"pendulum_bias\" joint=\"alpha\" gaintype=\"fixed\" gainprm=\"0\" biastype=\"affine\" \
             biasprm=\"{torque:?} 0 0\"/>"
        );
    }
    let encoder = if model.drive.as_ref().is_some_and(|d| d.encoder_on_motor) {
        "rotor"
    } else {
        "theta"
    };
    let third = if bodies.rotor > 0.0 { " 0" } else { "" };
    let _ = write!(
        out,
        r#"  </actuator>
  <sensor>
    <jointpos name="theta" joint="{encoder}"/>
    <jointpos name="alpha" joint="alpha"/>
  </sensor>
  <keyframe>
    <key name="hanging" qpos="0 {:?}{third}"/>
    <key name="upright" qpos="0 0{third}"/>
  </keyframe>
</mujoco>
"#,
        std::f64::consts::PI,
    );
    Ok(Exported {
        text: out,
        left_out,
    })
}

/// MuJoCo's friction acts ahead of the stop by the constraint's time constant, 10 ms by default. One step is the
/// stiffest that RK4 carries.
fn friction_law(timestep: f64) -> String {
    format!("solreffriction=\"{timestep:?} 1\" solimpfriction=\"0.9999 0.9999 0.001 0.5 2\"")
}

/// A stiffness or damping: one number where the higher powers are 0.
fn polynomial([first, second, third]: [f64; 3]) -> String {
    if second == 0.0 && third == 0.0 {
        format!("{first:?}")
    } else {
        format!("{first:?} {second:?} {third:?}")
    }
}

/// What lies between rotor and arm.
struct Drive {
    gap: f64,
    stiffness: f64,
    damping: f64,
    encoder_on_motor: bool,
}

impl Drive {
    fn coupling(&self, timestep: f64) -> String {
        if self.gap > 0.0 {
            let half = 0.5 * self.gap;
            // The ends of the play: stiff, hardly bouncing.
            let constant = 5.0 * timestep;
            return format!(
                "limited=\"true\" range=\"{:?} {half:?}\" solreflimit=\"{constant:?} 1\" \
                 solimplimit=\"0.9999 0.9999 0.001 0.5 2\"",
                -half
            );
        }
        let (stiffness, damping) = (self.stiffness, self.damping);
        format!("stiffness=\"{stiffness:?}\" damping=\"{damping:?}\" springlength=\"0\"")
    }
}

/// What the effects come to in MJCF.
struct Model {
    gravity: [f64; 3],
    unbalance: f64,
    arm_friction: f64,
    arm_quadratic: f64,
    /// Of the angle, its square and its cube.
    arm_spring: [f64; 3],
    arm_rest: f64,
    pendulum_friction: f64,
    pendulum_quadratic: f64,
    /// Stiffness and rest.
    pendulum_spring: [f64; 2],
    pendulum_bias: f64,
    motor_bias: f64,
    saturation: f64,
    lag: f64,
    drive: Option<Drive>,
    left_out: Vec<Remark>,
}

impl Model {
    fn of(rig: &Rig) -> Self {
        let mut model = Self {
            gravity: [0.0, 0.0, -rig.params.gravity],
            unbalance: 0.0,
            arm_friction: 0.0,
            arm_quadratic: 0.0,
            arm_spring: [0.0; 3],
            arm_rest: 0.0,
            pendulum_friction: 0.0,
            pendulum_quadratic: 0.0,
            pendulum_spring: [0.0, std::f64::consts::PI],
            pendulum_bias: 0.0,
            motor_bias: 0.0,
            saturation: f64::INFINITY,
            lag: 0.0,
            drive: None,
            left_out: Vec::new(),
        };
        for effect in rig.effects.iter().filter(|e| !e.is_off()) {
            model.add(effect, rig);
        }
        let quantised = "MJCF's sensors show angles, not counts; round what they show";
        model.left_out.push(Remark::new("[sensors]", quantised));
        if rig.limits != furuta_model::Limits::default() {
            let stops = "they stop a run and are no stops of the rig";
            model.left_out.push(Remark::new("[limits]", stops));
        }
        model
    }

    fn add(&mut self, effect: &Effect<f64>, rig: &Rig) {
        let id = effect.spec().id;
        let v = |name| value(effect, name).unwrap_or(0.0);
        match id {
            "arm.coulomb" => self.arm_friction += v("torque"),
            "arm.stribeck" => {
                self.arm_friction += v("coulomb");
                self.leave(id, "Coulomb friction of its sliding torque stands for it");
            }
            "arm.quadratic" => self.arm_quadratic += v("coefficient"),
            "arm.spring" | "arm.cable" if self.arm_spring == [0.0; 3] => {
                self.arm_spring = ["stiffness", "asymmetry", "cubic"].map(v);
                self.arm_rest = v("rest");
            }
            "arm.spring" | "arm.cable" => self.leave(
                id,
                "a joint of MJCF has one spring, which another effect is",
            ),
            "arm.tilt" => {
                let (lean, towards) = (v("angle"), v("direction"));
                let g = rig.params.gravity;
                self.gravity = [
                    g * lean.sin() * towards.cos(),
                    g * lean.sin() * towards.sin(),
                    -g * lean.cos(),
                ];
                self.unbalance = v("unbalance");
            }
            "pendulum.coulomb" => self.pendulum_friction += v("torque"),
            "pendulum.quadratic" => self.pendulum_quadratic += v("coefficient"),
            "pendulum.spring" => self.pendulum_spring = [v("stiffness"), v("rest")],
            "pendulum.bias" => self.pendulum_bias += v("torque"),
            // In the bodies.
            TRANSVERSE => {}
            "motor.bias" => self.motor_bias += v("voltage"),
            "motor.saturation" => self.saturation = v("limit"),
            "motor.lag" => self.lag = v("time_constant"),
            "drive.backlash" | "drive.compliance" => {
                self.drive = Some(Drive {
                    gap: v("gap"),
                    stiffness: v("stiffness"),
                    damping: v("damping"),
                    encoder_on_motor: v("encoder") > 0.5,
                });
            }
            // They depend on the angle or on the speed.
            "motor.ripple" | "motor.inductance" | "motor.current_limit" => self.leave(id, NO_MEANS),
            _ if id.starts_with("motor.") => self.leave(id, COMMAND),
            _ if id.starts_with("sensor.") => self.leave(id, READING),
            _ => self.leave(id, NO_MEANS),
        }
    }

    fn leave(&mut self, id: &str, why: &'static str) {
        self.left_out.push(Remark::new(id, why));
    }
}
