//! What the service counts and measures, for Prometheus.
//!
//! In: requests, problems, and the work on frames. Out: `GET /metrics`, in the text format.
//!
//! Each [`Metrics`](registry::Metrics) has a recorder of its own rather than the process's, so that services in one
//! process do not mix. Handles are made once; a request with a route and a status that were not seen before makes new
//! ones. Labels are routes, methods, statuses and kinds of problems: there are few of each, whatever clients send.
//!
//! What can go wrong: nobody asks for `/metrics`, and measurements pile up. So the sweeper sums them up from time to
//! time ([`Metrics::upkeep`](registry::Metrics::upkeep)).

pub mod registry;
