//! Threads of a batch: every chunk gets every job once, whoever sleeps.

use squirrel_batch::pool::Pool;
use std::thread;

fn add(chunk: &mut u64, job: u64) {
    *chunk += job;
}

#[test]
fn every_chunk_sees_every_job_once() {
    for threads in [0, 1, 2, 5, 100] {
        let mut pool = Pool::new(vec![0; 33], threads, add).unwrap();
        assert!(pool.threads() < 33);
        let jobs = 3000;
        for job in 1..=jobs {
            if job % 7 == 0 { pool.run_alone(job) } else { pool.run(job) }
        }
        for number in 0..33 {
            assert_eq!(*pool.chunk(number), jobs * (jobs + 1) / 2, "{threads} threads");
        }
    }
}

#[test]
fn threads_that_have_parked_come_back() {
    let mut pool = Pool::new(vec![0; 4], 3, add).unwrap();
    for job in 1..=3 {
        thread::sleep(std::time::Duration::from_millis(30));
        pool.run(job);
    }
    assert_eq!(*pool.chunk(3), 6);
}

#[test]
fn nothing_to_do_is_done() {
    Pool::new(Vec::new(), 4, add).unwrap().run(1);
}
