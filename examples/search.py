# SPDX-License-Identifier: MIT OR Apache-2.0
"""`search.py SPEC JOURNAL BATCHES`: a search by Optuna, scored by `specgen tune --evaluate` (docs/scale.md)."""

import json, os, subprocess, sys, tempfile

import optuna
from optuna.storages import JournalStorage
from optuna.storages.journal import JournalFileBackend, JournalFileOpenLock

spec, journal, batches = sys.argv[1], sys.argv[2], int(sys.argv[3])


def evaluate(candidates):
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "candidates.json")
        with open(path, "w") as file:
            json.dump(candidates, file)
        command = ["specgen", "tune", spec, "--evaluate", path, "--json"]
        done = subprocess.run(command, check=True, stdout=subprocess.PIPE)
    return json.loads(done.stdout)["result"]


parameters = evaluate([])["parameters"]
space = {p["name"]: optuna.distributions.FloatDistribution(*p["bounds"], log=True) for p in parameters}
storage = JournalStorage(JournalFileBackend(journal, lock_obj=JournalFileOpenLock(journal)))
study = optuna.create_study(study_name=spec, storage=storage, load_if_exists=True)
if not study.trials:
    study.enqueue_trial({p["name"]: p["spec"] for p in parameters})
for _ in range(batches):
    trials = [study.ask(space) for _ in range(16)]
    for trial, found in zip(trials, evaluate([trial.params for trial in trials])["candidates"]):
        # Unstable or at a limit: worse than every cost, which the sampler learns from; a failed trial it would forget.
        study.tell(trial, float("inf") if found["cost"] is None else found["cost"])
print(study.best_value, json.dumps(study.best_params))
