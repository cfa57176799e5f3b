-- The journal of one qcbus state directory. Safe to read with `sqlite3` while the broker runs.
-- A path that is no UTF-8 is written as `bytes:` and the path with its strange bytes as %XX.
-- Digests are SHA-256 in hexadecimal, times are milliseconds since 1970 (UTC).

-- One row per file with a verdict: what the broker remembers over a restart.
CREATE TABLE IF NOT EXISTS files (
    path     TEXT PRIMARY KEY,      -- absolute
    job      INTEGER NOT NULL,      -- the job that gave the verdict: a number that never comes back (`Settings::numbers`)
    verdict  TEXT NOT NULL,         -- accepted, rejected, undetermined
    digest   TEXT NOT NULL,         -- of the file's bytes
    basis    TEXT NOT NULL,         -- digest over everything that the verdict depends on
    config   TEXT NOT NULL,         -- digest of the configuration
    required_set TEXT NOT NULL,     -- JSON list of [bundle, version digest]; null: the bundle was missing
    errors   INTEGER NOT NULL,
    warnings INTEGER NOT NULL,
    information INTEGER NOT NULL,
    why      TEXT NOT NULL,         -- JSON list: for undetermined, the checkers that failed
    xqar     TEXT NOT NULL,         -- where the result lies; empty: it could not be written anywhere
    inputs   TEXT NOT NULL,         -- JSON list of [path, [size, mtime_ns, inode, digest, ctime_ns]]; null: absent, digest null: not readable
    racy     INTEGER NOT NULL,      -- 1: read so soon after a write that the stamps prove nothing
    at       INTEGER NOT NULL,
    epoch    INTEGER NOT NULL DEFAULT 0, -- of who had to judge
    written  TEXT NOT NULL DEFAULT '',   -- size, mtime_ns, inode of the verdict file as it was written
    own      TEXT NOT NULL DEFAULT '',   -- the verdict without the files that it rests on
    own_errors INTEGER NOT NULL DEFAULT 0, -- errors without the findings about those files
    rests_on TEXT NOT NULL DEFAULT ''    -- JSON list of [path, digest, verdict or null, errors]; empty: not known
) WITHOUT ROWID;

-- The registry: the bundles that must judge until they are removed, whether they are running or not.
CREATE TABLE IF NOT EXISTS members (
    name      TEXT PRIMARY KEY,
    version   TEXT NOT NULL,        -- that joined last
    origin    TEXT NOT NULL,        -- supervised: by manifest, or it comes with qcbus; joined: by hand
    catalogue TEXT NOT NULL,        -- JSON: what it offered then
    at        INTEGER NOT NULL
) WITHOUT ROWID;

-- Where the result lay of a file that has gone, while a reporter has not yet taken back its report.
CREATE TABLE IF NOT EXISTS gone (
    path     TEXT PRIMARY KEY,
    xqar     TEXT NOT NULL
) WITHOUT ROWID;

-- Every job that gave a verdict, for statistics; pruned after the retention time.
CREATE TABLE IF NOT EXISTS jobs (
    job      INTEGER PRIMARY KEY,
    path     TEXT NOT NULL,
    digest   TEXT NOT NULL,
    config   TEXT NOT NULL,
    verdict  TEXT NOT NULL,
    errors   INTEGER NOT NULL,
    warnings INTEGER NOT NULL,
    information INTEGER NOT NULL,
    bytes    INTEGER NOT NULL,      -- source bytes of the file and its dependencies
    micros   INTEGER NOT NULL,      -- from the queue to the stored result
    at       INTEGER NOT NULL
);
CREATE INDEX IF NOT EXISTS jobs_by_path ON jobs (path, at);
CREATE INDEX IF NOT EXISTS jobs_by_time ON jobs (at);

-- What each bundle did in a job.
CREATE TABLE IF NOT EXISTS job_bundles (
    job      INTEGER NOT NULL REFERENCES jobs (job) ON DELETE CASCADE,
    bundle   TEXT NOT NULL,
    version  TEXT NOT NULL,
    micros   INTEGER NOT NULL,      -- time spent checking, as the bundle says
    failure  TEXT NOT NULL,         -- empty: it did its work
    PRIMARY KEY (job, bundle)
) WITHOUT ROWID;

-- Checkers with findings, or that failed.
CREATE TABLE IF NOT EXISTS job_findings (
    job      INTEGER NOT NULL REFERENCES jobs (job) ON DELETE CASCADE,
    bundle   TEXT NOT NULL,
    checker  TEXT NOT NULL,
    status   TEXT NOT NULL,
    issues   INTEGER NOT NULL,
    PRIMARY KEY (job, bundle, checker)
) WITHOUT ROWID;

-- The checkers that were skipped, as a list of which there is one for all jobs that skip the same: most
-- files of one version do, and it is a hundred checkers.
CREATE TABLE IF NOT EXISTS job_skipped (
    job      INTEGER NOT NULL REFERENCES jobs (job) ON DELETE CASCADE,
    bundle   TEXT NOT NULL,
    list     INTEGER NOT NULL,      -- of checker_lists
    PRIMARY KEY (job, bundle)
) WITHOUT ROWID;

CREATE TABLE IF NOT EXISTS checker_lists (
    list     INTEGER PRIMARY KEY,   -- the first eight bytes of the digest of what is in it
    checkers TEXT NOT NULL          -- JSON list of checkers
);

-- Checkers with findings, or that did not complete.
CREATE VIEW IF NOT EXISTS job_checkers AS
    SELECT job, bundle, checker, status, issues FROM job_findings
    UNION ALL
    SELECT job, bundle, value AS checker, 'skipped' AS status, 0 AS issues
    FROM job_skipped JOIN checker_lists USING (list), json_each(checkers);

-- What each reporter has said of a file.
CREATE TABLE IF NOT EXISTS deliveries (
    path     TEXT NOT NULL,
    reporter TEXT NOT NULL,
    job      INTEGER,               -- whose result it has acknowledged; null: the file has gone, and the
                                    -- reporter has not yet taken back its report about it
    PRIMARY KEY (path, reporter)
) WITHOUT ROWID;
