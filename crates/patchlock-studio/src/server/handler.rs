//! Handlers of all types as one: routes to each type would take their time to compile.

use std::sync::Arc;

use axum::extract::Request;
use axum::handler::Handler;
use axum::response::Response;
use futures_util::future::BoxFuture;

/// A handler with its state.
#[derive(Clone)]
pub struct BoxedHandler(Arc<dyn Fn(Request) -> BoxFuture<'static, Response> + Send + Sync>);

/// Gives a handler its state.
pub fn boxed<T, S, H>(state: &S, handler: H) -> BoxedHandler
where
    S: Clone + Send + Sync + 'static,
    H: Handler<T, S> + Sync,
{
    let state = state.clone();
    BoxedHandler(Arc::new(move |request| Box::pin(handler.clone().call(request, state.clone()))))
}

impl Handler<(), ()> for BoxedHandler {
    type Future = BoxFuture<'static, Response>;

    fn call(self, request: Request, (): ()) -> Self::Future {
        self.0(request)
    }
}
