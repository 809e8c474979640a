"""Which page of the reference holds which name of the Python package."""

from __future__ import annotations

import furuta

GROUPS = {
    "simulation": (
        "Rigs and simulation",
        "Rig Hypothesis Simulator BatchSimulator Trajectory simulate simulate_batch measure signal catalogue linearize"
        " zero_order_hold",
    ),
    "diagnosis": (
        "Recordings and diagnosis",
        "Recording example Example diagnose Diagnosis Interrupted replay Replay timing",
    ),
    "calibration": (
        "Parameters from recordings",
        "calibrate Calibration validate Validation plan_experiment ExperimentPlan whiteness",
    ),
    "frequency": ("Frequency responses", "frf Frf fit_transfer_function TransferFit compare Comparison spectra"),
    "design": (
        "Control designs",
        "lqr dlqr lqi lqe dlqe place care dare robust_lqr controllability closed_loop rehearse relay"
        " design_swing_up steady_motion largest_sine arm_step",
    ),
    "control": (
        "Controllers and estimators",
        "run Run Controller Supervisor SwingUp Estimator controllers region_of_attraction",
    ),
    "plot": ("Figures", " ".join(f"plot.{name}" for name in furuta.plot.__all__)),
    "gym": ("The Gymnasium environment", "gym.RotaryPendulum gym.RotaryPendulumVector gym.draws_of"),
    "campaign": ("Campaigns", "campaign study CampaignError"),
    "papers": ("Experiments of the papers", " ".join(f"papers.{name}" for name in furuta.papers.__all__)),
    "errors": (
        "Errors",
        "FurutaError RigError RunError SimulationError SignalError RecordingError CalibrateError DiagnoseError"
        " ControllerError DesignError IdentificationError",
    ),
}


def pages() -> dict[str, str]:
    """Markdown by page."""
    return {
        f"api/{page}.md": f"# {title}\n\n" + "\n".join(f"::: furuta.{name}\n" for name in names.split())
        for page, (title, names) in GROUPS.items()
    }
