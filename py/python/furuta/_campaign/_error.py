"""What a campaign refuses."""

from __future__ import annotations

from furuta._furuta import FurutaError


class CampaignError(FurutaError):
    """A campaign that cannot be: another one's folder, cases that cannot be told apart, a function no worker can load.

    What a case itself raises is no `CampaignError`: it is in the case's row.
    """
