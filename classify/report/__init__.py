"""The report: how often the models are right, what an answer costs and what a record weighs, drawn as one page.

`run` makes the report. Importing the package alone loads no library. ``report.json`` holds every number of the page:

==================== ==============================================================================================
``schema_version``   "4"; a page is drawn from this version alone
``made``             date, command, quick, seed, seconds, resumed
``machine``          cpu, cores, system, python, packages (name to version), load
``classes``          the order of every table
``records``          what the test set holds: total, by class, by kind, radars, extremes of SNR [dB] and dwell [s]
``models``           each with name, bytes, sha256, version, inputs, input_bytes, accept, accept_by_pulses, envelope
``scores``           by model: see `scores.score`; a rate is value, low, high (95 % Wilson), right, count
``reference``        the radar of the records that are timed, weighed and shown
``cost``             threads, and one entry a batch size: see `cost.time_chain`
``trade``            accuracy against cost, the front and the budgets: see `trade.weigh_up`
``front``            every choice of picture, model and dwell: see `front.measure_front`
``fft_against_stft`` one a record length: see `fft_against_stft.time_fft_against_stft`
``time_law``         time against operations: see `fft_against_stft.time_law`
``storage``          one a form of a record: see `storage.weigh`
``examples``         one a class: see `examples.show_examples`
``stft_pictures``    the paper's four STFTs: see `examples.show_stfts`
``families``         what accuracy is lost on kinds left out of the training: see `families.left_out`
``stability``        worst cell of each stage and parameter, if there is a stability.json: see `stability.run`
``tables``           the paper's tables made again: title to rows, see `classify.tables`
``training``         how the models were trained; None if there is no train.json beside them
``config``           the settings of the run: see `settings.ReportConfig`
==================== ==============================================================================================
"""

import logging

# Without a writable home folder matplotlib keeps its font cache elsewhere and warns about it; the user need not know.
logging.getLogger("matplotlib").setLevel(logging.ERROR)
