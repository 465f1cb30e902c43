"""An equivalent block from outcomes alone: amplitude, frequency, fell or not."""

from twin.calibration.outcomes.chains import Effort
from twin.calibration.outcomes.fit import OutcomeFit, fit_outcomes
from twin.calibration.outcomes.trials import Trial, names_outcomes, read_trials
from twin.calibration.outcomes.words import outcome_lines

__all__ = ["Effort", "OutcomeFit", "Trial", "fit_outcomes", "names_outcomes", "outcome_lines", "read_trials"]
