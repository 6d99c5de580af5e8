"""Options of these tests."""


def pytest_addoption(parser):
    parser.addoption("--update-stub", action="store_true", help="write mechanisms.pyi again")
