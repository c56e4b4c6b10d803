import operator
import subprocess
import sys
import time
from multiprocessing import get_context

import pytest
from bladewing.classify.workers import in_order, workers_at_hand
from threadpoolctl import threadpool_info


@pytest.mark.skipif(workers_at_hand() == 1, reason="on one processor nothing has more threads")
def test_a_worker_computes_on_one_thread():
    for libraries in in_order(operator.call, [threadpool_info] * 2, workers=2):
        threads = [library["num_threads"] for library in libraries if library["user_api"] == "blas"]
        assert threads
        assert set(threads) == {1}


def test_a_worker_of_the_caller_s_own_outlives_tasks_that_are_given_up():
    own = get_context("spawn").Process(target=time.sleep, args=(30,))
    own.start()
    try:
        tasks = in_order(abs, [-1, -2, -3, -4], workers=2)
        assert next(tasks) == 1
        tasks.close()
        assert own.is_alive()
    finally:
        own.terminate()
        own.join()


UNGUARDED = """
from bladewing.classify.workers import in_order

print(list(in_order(abs, [-1, -2, -3], workers=2)), __file__[-9:], __spec__)
"""


def test_workers_do_not_run_a_script_again_that_has_no_guard(tmp_path):
    script = tmp_path / "script.py"
    script.write_text(UNGUARDED)
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, timeout=120)
    assert (done.stdout, done.stderr, done.returncode) == ("[1, 2, 3] script.py None\n", "", 0)
