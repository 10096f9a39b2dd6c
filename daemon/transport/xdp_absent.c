// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * In place of the AF_XDP kind where the build had no libxdp: it is refused in
 * words, like a kernel or a card that cannot, and another kind is taken.
 */
#include <errno.h>
#include "daemon/transport/kind.h"

static int refuse(struct transport *t, const struct transport_options *options)
{
	(void)t;
	(void)options;
	return -ENOSYS;
}

static const struct transport_ops absent_ops = {
	.name = "xdp",
	.open = refuse,
};

const char *transport_xdp_refused(int rc)
{
	(void)rc;
	return "this pokeysd was built without libxdp";
}

const struct transport_kind transport_xdp = {
	.ops = &absent_ops,
	.size = sizeof(struct transport),
};
