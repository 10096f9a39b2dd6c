/* SPDX-License-Identifier: MIT */
/*
 * What a realtime thread does with a client: read and write images.
 *
 * Nothing here makes a system call, allocates or can panic: a visit to a
 * handover, a copy, a few atomic operations. The images are judged behind the
 * border (rust/src/layout.rs), before a byte of them reaches the caller.
 */
#include <errno.h>
#include <string.h>
#include "shm/client_private.h"
#include "shm/command_cell.h"
#include "shm/read_into.h"

/* The daemon's first value is a whole image; nothing at all is as foreign as garbage. */
static int judged(int r)
{
	return r == 1 ? 0 : -EPROTO;
}

static int read_mirror(pokeys_client *client, enum mirror_image image, void *out)
{
	const struct mirror_view *view = handover_take(&client->mirror);
	int r = view ? mirror_read(view, image, out) : -ENOTCONN;

	handover_give_back(&client->mirror);
	return r;
}

int pokeys_client_read(pokeys_client *client, struct pokeys_state *out)
{
	const struct iox_state_reader *reader;
	int r;

	if (!client_commands(client))
		return read_mirror(client, MIRROR_STATE, out);
	reader = handover_take(&client->state);
	r = reader ? judged(iox_state_read(reader, out)) : -ENOTCONN;
	handover_give_back(&client->state);
	return r;
}

int client_read_into(pokeys_client *client, struct pokeys_state *out)
{
	const struct iox_state_reader *reader;
	int r;

	if (!client_commands(client))
		return read_mirror(client, MIRROR_STATE, out);
	reader = handover_take(&client->state);
	r = reader ? judged(iox_state_read_into(reader, out)) : -ENOTCONN;
	handover_give_back(&client->state);
	return r;
}

int pokeys_client_read_diag(pokeys_client *client, struct pokeys_diag *out)
{
	const struct iox_diag_reader *reader;
	int r;

	if (!client_commands(client))
		return read_mirror(client, MIRROR_DIAG, out);
	reader = handover_take(&client->diag);
	r = reader ? judged(iox_diag_read(reader, out)) : -ENOTCONN;
	handover_give_back(&client->diag);
	return r;
}

int pokeys_client_read_report(pokeys_client *client, struct pokeys_report *out)
{
	const struct iox_report_reader *reader;
	int r;

	if (!client_commands(client))
		return read_mirror(client, MIRROR_REPORT, out);
	reader = handover_take(&client->report);
	r = reader ? judged(iox_report_read(reader, out)) : -ENOTCONN;
	handover_give_back(&client->report);
	return r;
}

/* `more` are flags besides the command's. The cell, or NULL. */
static const struct pokeys_command *write_cell(struct iox_command_writer *writer,
					       const struct pokeys_command *command, uint32_t more)
{
	struct pokeys_command *cell = iox_command_loan(writer);

	if (!cell)
		return NULL;
	command_cell_fill(cell, command);
	cell->flags |= more;
	iox_command_commit(writer);
	return cell;
}

int pokeys_client_write(pokeys_client *client, const struct pokeys_command *command)
{
	if (!client_commands(client))
		return -EPERM;
	return client->holder.running ? -EBUSY : client_write(client, command);
}

int client_write(struct pokeys_client *client, const struct pokeys_command *command)
{
	struct iox_command_writer *writer = handover_take(&client->command);

	if (writer)
		client->written = write_cell(writer, command, 0);
	handover_give_back(&client->command);
	return writer ? 0 : -ENOTCONN;
}

/* The same heartbeat: if the daemon has not seen it yet, it still does what the image says. */
void client_leave(struct pokeys_client *client)
{
	struct iox_command_writer *writer = handover_take(&client->command);

	if (writer && client->written)
		write_cell(writer, client->written, POKEYS_COMMAND_ENDS);
	handover_give_back(&client->command);
}

static void write_wish_cell(struct iox_wish_writer *writer, const struct pokeys_wish *wish)
{
	struct pokeys_wish *cell = iox_wish_loan(writer);

	if (!cell)
		return;
	memcpy(cell, wish, sizeof(*cell));
	cell->magic = POKEYS_WISH_MAGIC;
	cell->version = POKEYS_WISH_VERSION;
	cell->size_units = sizeof(*cell) / 8;
	cell->hash = POKEYS_WISH_HASH;
	iox_wish_commit(writer);
}

int pokeys_client_write_wish(pokeys_client *client, const struct pokeys_wish *wish)
{
	struct iox_wish_writer *writer;

	if (!(client->flags & POKEYS_CLIENT_COMMANDER))
		return -EPERM;
	writer = handover_take(&client->wish);
	if (writer)
		write_wish_cell(writer, wish);
	handover_give_back(&client->wish);
	return writer ? 0 : -ENOTCONN;
}
