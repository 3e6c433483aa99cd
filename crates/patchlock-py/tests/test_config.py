"""Tests of Config: access to settings, errors, copies."""

from __future__ import annotations

import copy
import pickle

import numpy as np
import pytest

import patchlock
from patchlock import Config


def test_settings_are_attributes_in_groups():
    config = Config()
    assert config.seed == 0
    config.seed = np.int64(3)
    config.robust.search = 7
    config.robust.patches.templates = 8
    assert (config.seed, config.robust.search, config.robust.patches.templates) == (3, 7.0, 8)
    group = config.robust
    group.rotate = False
    assert config.robust.rotate is False, "a group is a view"
    paper = Config("paper")
    paper.paper.gamma = "one"
    assert paper.paper.gamma == "one" and paper.paper.particles == 650


def test_every_setting_of_the_table_has_its_default():
    for parameter in patchlock.parameters(research=True):
        config = Config(parameter.group if parameter.group in ("paper", "network") else "robust")
        if parameter.group == "":
            place = config
        elif parameter.group == "patches":
            place = config.robust.patches
        else:
            place = getattr(config, parameter.group)
        assert getattr(place, parameter.name) == parameter.default, parameter.name
        assert parameter.name in dir(place)
        setattr(place, parameter.name, parameter.default)
        assert parameter.allowed and parameter.source and parameter.purpose


@pytest.mark.parametrize(
    ("change", "error", "says"),
    [
        ("config.robust.serch = 9", AttributeError, "no setting 'serch'; did you mean search"),
        ("config.robust.serch", AttributeError, "did you mean search"),
        ("config.search", AttributeError, r"in another group: config\.robust\.search"),
        ("config.robust.templates = 9", AttributeError, r"config\.robust\.patches\.templates"),
        ("config.robust.seed", AttributeError, r"in another group: config\.seed"),
        ("config.paper", AttributeError, r'start from patchlock\.Config\("paper"\)'),
        ("config.particles = 9", AttributeError, r'start from patchlock\.Config\("paper"\)'),
        ("config.robust = 3", AttributeError, "robust is a group of settings"),
        ("config.robust.search = 0", ValueError, "`search` is 0.*; allowed: "),
        ("config.robust.scale_count = 2.5", TypeError, "`scale_count` is 2.5; it takes a whole number"),
        ("config.robust.scale_count = True", TypeError, "`scale_count` is True; it takes a whole number"),
        ("config.robust.scale_count = -1", ValueError, "allowed: "),
        ("config.robust.search = 'far'", TypeError, "`search` is 'far'; it takes a number"),
        ("config.robust.search = float('nan')", ValueError, "search"),
        ("config.robust.search = None", TypeError, "`search` is None; it takes a number"),
        ("config.robust.rotate = 1", TypeError, "`rotate` is 1; it takes true or false"),
        ("paper.paper.gamma = 'two'", ValueError, "exp_visible, one, visible, exp_error"),
        ("paper.paper.gamma = 2", TypeError, "`gamma` is 2; it takes a word"),
    ],
)
def test_errors_name_the_setting_the_value_and_what_is_allowed(change, error, says):
    config, paper = Config(), Config("paper")
    with pytest.raises(error, match=says):
        exec(change)
    assert (config, paper) == (Config(), Config("paper"))


def test_settings_are_compared_copied_and_pickled():
    config = Config()
    config.seed = 4
    config.robust.trial = 3
    config.robust.patches.templates = 8
    for again in (copy.copy, copy.deepcopy, lambda c: pickle.loads(pickle.dumps(c))):
        copied = again(config)
        assert copied == config
        copied.seed = 5
        assert copied != config
    assert config.robust == config.robust
    assert config.robust != Config().robust
    assert repr(config) == "<Config 'robust', seed=4, robust.trial=3, robust.patches.templates=8>"


def test_all_settings_as_a_dictionary():
    config = Config("paper")
    found = config.to_dict()
    assert list(found) == ["seed", "paper"]
    assert found["paper"]["particles"] == 650
    assert found["paper"]["patches"]["templates"] == config.paper.patches.templates


def test_a_tracker_copies_its_settings(film, scene):
    config = Config()
    tracker = patchlock.Tracker(film[0], scene.truth(0), config)
    config.seed = 9
    assert tracker.config == Config()
    tracker.config.seed = 9
    assert tracker.config.seed == 0
