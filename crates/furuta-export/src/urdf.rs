//! A rig as a robot description (URDF).
//!
//! Links `base`, `arm` and `pendulum`; joints `theta` (about `z`) and `alpha` (about the arm's `x`, 0 upright). URDF
//! knows no motor in volts and no springs: the file has a transmission for the arm's torque, and a comment with the
//! motor's numbers and with what it does not carry over.

use std::fmt::Write as _;

use crate::body::{Bodies, BodyError, NO_BODY, TRANSVERSE, value};
use crate::remark::{Exported, Remark, comment, name};
use furuta_model::{Actuation, Rig};

const NO_MEANS: &str = "URDF has no means for it";

/// The rig as URDF. Of its effects `arm.coulomb`, `pendulum.coulomb` (friction) and `pendulum.inertia_transverse` are
/// carried over; the back-EMF, which damps the arm while its motor has a voltage, is part of the joint's damping.
///
/// # Errors
/// A rig of which no rigid bodies have the moments of inertia: see [`BodyError`].
///
/// ```
/// let rig = furuta_model::Rig::builtin("qube-servo-2").ok_or("no such rig")?;
/// let exported = furuta_export::urdf(&rig)?;
/// assert!(exported.text.contains("<joint name=\"alpha\" type=\"continuous\">"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn urdf(rig: &Rig) -> Result<Exported, BodyError> {
    let whole: Vec<_> = rig
        .effects
        .iter()
        .filter(|e| e.spec().id == TRANSVERSE)
        .copied()
        .collect();
    let bodies = Bodies::of(&rig.params, &whole)?;
    let (p, k) = (&rig.params, rig.params.coefficients());
    let actuation = p.motor.actuation;
    let word = match actuation {
        Actuation::Voltage => "volt of command",
        other => other.unit(),
    };
    let mut left_out = Vec::new();
    let (mut arm_friction, mut pendulum_friction) = (0.0, 0.0);
    for effect in rig.effects.iter().filter(|e| !e.is_off()) {
        let v = |name| value(effect, name).unwrap_or(0.0);
        match effect.spec().id {
            "arm.coulomb" => arm_friction += v("torque"),
            "pendulum.coulomb" => pendulum_friction += v("torque"),
            TRANSVERSE => {}
            "arm.stribeck" => {
                arm_friction += v("coulomb");
                let why = "Coulomb friction of its sliding torque stands for it";
                left_out.push(Remark::new("arm.stribeck", why));
            }
            id => left_out.push(Remark::new(id, NO_MEANS)),
        }
    }
    if bodies.without_effect {
        left_out.push(Remark::new(TRANSVERSE, NO_BODY));
    }
    if bodies.armature > 0.0 {
        let why = "the part that exceeds the sum of the two others: URDF has no armature";
        left_out.push(Remark::new("pendulum.inertia", why));
    }
    left_out.push(Remark::new("[sensors]", NO_MEANS));
    left_out.push(Remark::new(
        "environment.gravity",
        "URDF leaves it to the simulator",
    ));
    if rig.limits != furuta_model::Limits::default() {
        let stops = "they stop a run and are no stops of the rig";
        left_out.push(Remark::new("[limits]", stops));
    }
    let mut out = String::new();
    // Writing to a String cannot fail.
    let _ = write!(
        out,
        r#"<?xml version="1.0"?>
<robot name="{}">
  <!-- {}
       Written by furuta. SI units, radians; alpha = 0 upright; gravity of the rig: {:?} m/s2 along -z.
       Torque on theta for one {}: {:?} {} (without the back-EMF, which is in theta's damping:
       {:?} of {:?} N m s/rad); largest command {:?} {}.
"#,
        name(&rig.name),
        comment(&rig.source),
        p.gravity,
        word,
        k.drive,
        actuation.unit_of("N m/V"),
        k.arm_damping - p.arm.viscous,
        k.arm_damping,
        p.motor.command_limit,
        actuation.unit(),
    );
    for remark in &left_out {
        let _ = writeln!(out, "       {}", comment(&remark.to_string()));
    }
    let (arm, length, com) = (bodies.arm, p.arm.length, p.pendulum.com);
    let [hinge, transverse, axial] = bodies.pendulum;
    let half_turn = std::f64::consts::FRAC_PI_2;
    let _ = write!(
        out,
        r#"  -->
  <link name="base"/>
  <joint name="theta" type="continuous">
    <parent link="base"/>
    <child link="arm"/>
    <axis xyz="0 0 1"/>
    <dynamics damping="{:?}" friction="{arm_friction:?}"/>
  </joint>
  <link name="arm">
    <inertial>
      <origin xyz="0 0 0"/>
      <mass value="1"/>
      <inertia ixx="{arm:?}" iyy="{arm:?}" izz="{arm:?}" ixy="0" ixz="0" iyz="0"/>
    </inertial>
    <visual>
      <origin xyz="{:?} 0 0" rpy="0 {half_turn:?} 0"/>
      <geometry><cylinder radius="{:?}" length="{length:?}"/></geometry>
    </visual>
  </link>
  <joint name="alpha" type="continuous">
    <parent link="arm"/>
    <child link="pendulum"/>
    <origin xyz="{length:?} 0 0"/>
    <axis xyz="1 0 0"/>
    <dynamics damping="{:?}" friction="{pendulum_friction:?}"/>
  </joint>
  <link name="pendulum">
    <inertial>
      <origin xyz="0 0 {com:?}"/>
      <mass value="{:?}"/>
      <inertia ixx="{hinge:?}" iyy="{transverse:?}" izz="{axial:?}" ixy="0" ixz="0" iyz="0"/>
    </inertial>
    <visual>
      <origin xyz="0 0 {com:?}"/>
      <geometry><cylinder radius="{:?}" length="{:?}"/></geometry>
    </visual>
  </link>
  <transmission name="motor">
    <type>transmission_interface/SimpleTransmission</type>
    <joint name="theta">
      <hardwareInterface>hardware_interface/EffortJointInterface</hardwareInterface>
    </joint>
    <actuator name="motor">
      <mechanicalReduction>1</mechanicalReduction>
    </actuator>
  </transmission>
</robot>
"#,
        k.arm_damping,
        0.5 * length,
        0.05 * length,
        p.pendulum.viscous,
        p.pendulum.mass,
        0.05 * com,
        2.0 * com,
    );
    Ok(Exported {
        text: out,
        left_out,
    })
}
