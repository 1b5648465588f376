"""Autofocus of measured phase history with known errors: the figures that the project promises."""

import pytest

from sarfocus.experiments import gotcha


@pytest.fixture(scope="module")
def result(data_directory):
    if not (data_directory / gotcha.FILES[0]).exists():
        pytest.skip(f"no Gotcha files in {data_directory}")
    return gotcha.run(data=data_directory)


def test_injected_errors_come_off_and_the_reflectors_come_back(result):
    broken = [item for item in result.required if not item.holds]
    assert not broken
    assert len(result.required) == 17  # four figures for each of four errors, one for the untouched data


def test_the_result_does_not_depend_on_the_error(result):
    """The same optimum is found from every start: what is left is what the data hold of their own."""
    own = result.rows[0]["residual"]
    for row in result.rows[1:]:
        assert row["status"] == "converged"
        assert row["residual"] == pytest.approx(own, abs=0.01)  # a tenth of it
        assert row["entropy_after"] < row["entropy_before"] - 0.5


def test_what_is_wrong_with_the_data_folder_is_said(tmp_path):
    with pytest.raises(ValueError, match="az001"):
        gotcha.run(data=tmp_path)
