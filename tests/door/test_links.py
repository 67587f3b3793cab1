"""What `serve` of the door takes besides the plant: who may reach it, certificates, and effects of one's own."""

from __future__ import annotations

import pytest

import bristle as br
from hil.testing import make_loopback_authority


def test_other_machines_reach_it_only_when_that_is_meant():
    with pytest.raises(br.BadInput, match="other machines could reach") as said, br.serve(listen="tcp://0.0.0.0:0"):
        pass
    assert said.value.parameter == "expose"
    with br.serve(listen="tcp://0.0.0.0:0", expose=True) as served:
        assert served.address.startswith("tcp://0.0.0.0:")


def test_tls_takes_certificates(tmp_path):
    with pytest.raises(br.BadInput, match="TLS needs certificates") as said, br.serve(listen="tls://127.0.0.1:0"):
        pass
    assert said.value.parameter == "certificates"
    made = make_loopback_authority(tmp_path / "ca")
    with br.serve(listen="tls://127.0.0.1:0", certificates=made.server) as served:
        assert served.address.startswith("tls://127.0.0.1:")


def test_an_effect_is_looked_up_in_the_catalogue_that_is_given():
    few = br.Catalogue(tuple(br.CATALOGUE[one] for one in ("inertia", "spring", "lugre", "backlash")))
    asked = {"friction": "lugre", "effects": {"sensor_lag": {}}}
    with pytest.raises(br.BadInput, match="sensor_lag"):
        br.serve(**asked, catalogue=few)
    br.serve(friction="lugre", effects={"backlash": {}}, catalogue=few)
